// Tests every format derived from the list of settings' fields: it writes each field, and reads it back.

#include <gmock/gmock.h>

#include <string>
#include <type_traits>
#include <vector>

#include "golden/suite/sidecar.h"
#include "golden/suite/suite.h"
#include "program.h"
#include "render/video/panel.h"
#include "sim/log/pose_log.h"
#include "sim/measure/json.h"
#include "sim/model/settings_fields.h"
#include "sim/study/sweep.h"

namespace substep {

/// Prints a field as the parameter of a test: by its name, since its bytes differ from run to run.
static void PrintTo(const SettingsField& field, std::ostream* out) {
  *out << field.name;
}

namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Returns the names of fields in which two settings differ.
std::vector<std::string> differences(const Settings& a, const Settings& b) {
  std::vector<std::string> names;
  for (const SettingsField& field : settings_fields) {
    if (text_of(a, field) != text_of(b, field)) names.emplace_back(field.name);
  }
  return names;
}

class EveryField : public Program, public testing::WithParamInterface<SettingsField> {
 protected:
  const SettingsField& field() const { return GetParam(); }
  std::string name() const { return std::string(field().name); }
  std::string typed(const Settings& settings) const { return text_of(settings, field()); }

  /// Returns settings of an algorithm that reads the field.
  Settings defaults() const { return default_settings(field().first); }

  /// Returns the settings with another value of the field.
  Settings changed() const {
    Settings settings = defaults();
    std::visit(
        [&](auto member) {
          auto& value = settings.*member;
          using Value = std::remove_reference_t<decltype(value)>;
          if constexpr (std::is_enum_v<Value>) {
            value = value == Value{} ? static_cast<Value>(1) : Value{};
          } else if constexpr (std::is_same_v<Value, int>) {
            ++value;
          } else {
            value = value == 0 ? 0.25 : value / 2;
          }
        },
        field().member);
    return settings;
  }

  /// Returns the field's value as JSON and TOML write it.
  std::string value_in(const Settings& settings) const {
    const auto json = to_json(settings);
    return json.contains(name()) ? json.at(name()).dump() : typed(settings);
  }
};

TEST_P(EveryField, CanBeChangedAlone) {
  EXPECT_THAT(differences(defaults(), changed()), ElementsAre(name()));
  EXPECT_NO_THROW(check(changed()));
}

TEST_P(EveryField, IsInLabels) {
  EXPECT_NE(label(changed()), label(defaults()));
}

TEST_P(EveryField, AppearsInPoseLog) {
  PoseLog log;
  log.scene = "none.gltf";
  log.bodies = {"world"};
  log.frames.resize(1);
  log.settings = defaults();
  PoseLog other = log;
  other.settings = changed();
  EXPECT_THAT(differences(parse_pose_log(to_text(other), "log").settings, changed()), IsEmpty());
  EXPECT_EQ(compare(log, other).headers, name() + ": " + typed(defaults()) + " → " + typed(changed()));
}

TEST_P(EveryField, AppearsInSweepRecordAndTable) {
  SweepRecord record;
  record.size = record.duration = 1;
  record.settings = defaults();
  record.metrics.emplace();
  SweepRecord other = record;
  other.settings = changed();
  EXPECT_THAT(differences(record_in(to_json(other)).settings, changed()), IsEmpty());
  EXPECT_THAT(errors_csv({other}), HasSubstr("," + name() + ","));
  EXPECT_NE(errors_csv({other}), errors_csv({record}));
}

TEST_P(EveryField, TakesListInSweepFile) {
  std::string text = "[[grid]]\nscenes = [\"" + scene("pendulum.gltf") + "\"]\n";
  if (name() == "step") {
    text += "algorithms = [\"a1\"]\ndivisions = [1, 2]\n";
  } else if (name() == "algorithm") {
    text += "algorithms = [\"a1\", \"a2\"]\n";
  } else {
    text += "algorithms = [" + to_json(defaults())["algorithm"].dump() + "]\n";
    text += name() + " = [" + value_in(defaults()) + ", " + value_in(changed()) + "]\n";
  }
  write("one.toml", text);
  const Sweep sweep = read_sweep(folder() / "one.toml");
  ASSERT_EQ(sweep.jobs.size(), 2U) << "runs of equal keys are made once";
  const std::vector<SweepJob>& jobs = sweep.jobs;
  EXPECT_NE(jobs[0].key, jobs[1].key);
  EXPECT_THAT(differences(jobs[0].settings, jobs[1].settings), testing::Contains(name()));
  if (name() == "step") return;
  EXPECT_EQ(typed(jobs[1].settings), typed(changed()));
}

TEST_P(EveryField, AppearsInSuiteAndSidecar) {
  const std::string algorithm = to_json(changed())["algorithm"].dump();
  std::string text = "[[case]]\nscene = \"one.gltf\"\nalgorithms = [" + algorithm + "]\n";
  if (name() != "algorithm") text += "settings = { " + name() + " = " + value_in(changed()) + " }\n";
  write("suite.toml", text);
  golden::SuiteCase entry = golden::read_suite(folder() / "suite.toml").cases.at(0);
  EXPECT_EQ(typed(entry.settings), typed(changed()));
  // The case's settings override the scene's.
  Scene scene;
  scene.step = 0.5;
  scene.substeps = 40;
  EXPECT_EQ(typed(entry.settings_for(scene)), typed(changed()));
  PoseLog log;
  log.frames.resize(1);
  const auto sidecar = golden::make_sidecar(entry, log, "", Scene{}, {}, {});
  EXPECT_EQ(sidecar["settings"][name()].dump(), value_in(changed()));
}

TEST_P(EveryField, IsAnOption) {
  const std::string algorithm = text_of(changed(), field_named("algorithm"));
  const std::string key = name() == "algorithm" ? "" : " --set " + name() + "=" + typed(changed());
  printed("run $S/pendulum.gltf --duration 0.02 --output one.poses --algorithm " + algorithm + key);
  const PoseLog log = read_pose_log(folder() / "one.poses");
  EXPECT_EQ(typed(log.settings), typed(changed()));
  const std::string help = printed("help settings");
  EXPECT_THAT(help, HasSubstr("  " + name() + " "));
  EXPECT_THAT(help, HasSubstr(" soft or avbd; default a3\n"));
}

using ContactSettings = Program;

// τ and κ hold for all rows, as in the report, unless contacts get their own, in any order.
TEST_F(ContactSettings, FollowTauAndKappaUnlessGivenTheirOwn) {
  const auto expect = [](const Settings& settings, double tau, double kappa) {
    EXPECT_EQ(settings.of_contacts().tau, tau);
    EXPECT_EQ(settings.of_contacts().kappa, kappa);
  };
  const auto of_suite = [&](const std::string& text) {
    write("suite.toml",
          "[[case]]\nscene = \"one.gltf\"\nalgorithms = [\"a5\"]\nsettings = { " + text + " }\n");
    return golden::read_suite(folder() / "suite.toml").cases.at(0).settings;
  };
  const auto of_option = [&](const std::string& words) {
    printed("run $S/pendulum.gltf --duration 0.02 --output one.poses " + words);
    return read_pose_log(folder() / "one.poses").settings;
  };
  const Settings defaults = default_settings(Algorithm::a5);
  ASSERT_NE(defaults.of_contacts().tau, defaults.tau);
  const auto of_panel = [&](const std::string& text) {
    return render::panel_in("a5," + text, {[&](Algorithm) { return defaults; }}).settings;
  };
  expect(of_suite("substeps = 3"), defaults.contact_tau, defaults.contact_kappa);
  expect(of_suite("tau = 0.5"), 0.5, 1);
  expect(of_suite("kappa = 0.8"), 0.6, 0.8);
  expect(of_suite("contact_tau = 0.7, tau = 0.5, kappa = 0.8"), 0.7, 0.8);
  expect(of_panel("n=3"), defaults.contact_tau, defaults.contact_kappa);
  expect(of_panel("tau=0.5"), 0.5, 1);
  expect(of_panel("contact_kappa=0.7,tau=0.5"), 0.5, 0.7);
  expect(of_option("--substeps 3"), defaults.contact_tau, defaults.contact_kappa);
  expect(of_option("--set tau=0.5"), 0.5, 1);
  expect(of_option("--set contact_kappa=0.7,tau=0.5"), 0.5, 0.7);
  expect(of_option("--set tau=0.5/0.9 --set kappa=1/0.7"), 0.9, 0.7);
  expect(of_panel("tau=0.5/0.9,kappa=1/0.7"), 0.9, 0.7);
}

INSTANTIATE_TEST_SUITE_P(Settings, EveryField, testing::ValuesIn(settings_fields),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace substep
