#include "sim/study/sweep_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "../temporary_folder.h"
#include "sim/model/settings_fields.h"
#include "sim/model/usual_settings.h"
#include "tests/folders.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

class SweepFile : public testing::Test {
 protected:
  /// Reads a sweep of one grid over a scene of the tree.
  Sweep sweep(const std::string& scene, const std::string& lines) const {
    const fs::path file = folder_.path() / "sweep.toml";
    std::ofstream(file) << "[[grid]]\nscenes = [\"" << test::source_folder << "/scenes/" << scene
                        << ".gltf\"]\n"
                        << lines;
    return read_sweep(file);
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(SweepFile, MissingKeysAreTheDefaultsOfARun) {
  // A governor has a closed loop, for which A2 and A3 have defaults of their own.
  for (const char* const scene : {"pendulum", "governor", "box_stack"}) {
    const Sweep all =
        sweep(scene, "algorithms = [\"a1\", \"a2\", \"a3\", \"a4\", \"a5\", \"soft\", \"avbd\"]\n");
    ASSERT_EQ(all.jobs.size(), 7u);
    for (const SweepJob& job : all.jobs) {
      const Settings usual = usual_settings(all.scenes.at(scene), job.settings.algorithm);
      EXPECT_EQ(label(job.settings), label(usual)) << scene;
      for (const SettingsField& field : settings_fields) {
        if (!field.is_read_by(usual.algorithm)) continue;
        EXPECT_EQ(text_of(job.settings, field), text_of(usual, field)) << job.key << " " << field.name;
      }
    }
  }
}

TEST_F(SweepFile, SweepOfScenesUsesTheDefaults) {
  const fs::path file = fs::path(test::source_folder) / "scenes/heavy_chain.gltf";
  const Sweep sweep = sweep_of({file}, false);  // whose n is not 10
  int defaults = 0;
  for (const SweepJob& job : sweep.jobs) {
    const Settings usual = usual_settings(sweep.scenes.at("heavy_chain"), job.settings.algorithm);
    EXPECT_EQ(tau_text(job.settings), job.settings.algorithm >= Algorithm::a3 ? tau_text(usual) : "1");
    defaults += label(job.settings) == label(usual) ? 1 : 0;
  }
  EXPECT_EQ(defaults, 5) << "the default of each algorithm is measured";
}

TEST_F(SweepFile, TauAloneHoldsForContactsToo) {
  const Sweep one = sweep("box_stack", "algorithms = [\"a5\"]\ntau = [1]\n");
  EXPECT_EQ(tau_text(one.jobs.at(0).settings), "1");
  EXPECT_EQ(kappa_text(one.jobs.at(0).settings), "1");
}

TEST_F(SweepFile, EnginesDoTenIterationsByDefault) {
  const Sweep one = sweep("pendulum", "engines = [\"bullet-si\"]\ndivisions = [2]\n");
  EXPECT_EQ(one.jobs.at(0).key, "pendulum.bullet-si-h2-m10");
}

}  // namespace
}  // namespace substep
