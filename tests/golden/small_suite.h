#pragma once
/// A suite of one short case in a folder of its own, to be checked, broken and approved.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "golden/approval/approve.h"
#include "golden/check/case_context.h"
#include "golden/report/failures.h"
#include "sim/log/file_output.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace substep::golden {

inline std::string read_text(const std::filesystem::path& file) {
  return content_of(file).value_or("");
}

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  write_file(file, text);
}

/// Replaces text in a file. Throws when there is none, so that a test cannot pass by changing nothing.
inline void replace_in(const std::filesystem::path& file, const std::string& old_text,
                       const std::string& new_text) {
  std::string text = read_text(file);
  const auto at = text.find(old_text);
  if (at == std::string::npos) throw std::runtime_error(file.string() + " has no '" + old_text + "'");
  write_text(file, text.replace(at, old_text.size(), new_text));
}

/// The result of a check's last case.
struct CheckResult : CaseResult {
  std::string text;  ///< the printed explanation
  int exit_code = 1;
  std::vector<std::filesystem::path> orphans;
};

/// Checks in this process.
inline CheckResult check(const CheckOptions& options) {
  CheckResult result;
  check_with(options, [&](const CheckPlan& plan, CheckOutput& output) {
    const ResultsLocation location = location_of({{"suite", plan.suite.file.string()}}, options.output);
    CaseChecker checker(plan);
    if (options.cases.empty()) result.orphans = orphans(plan.suite);
    for (const SuiteCase& entry : plan.cases) {
      static_cast<CaseResult&>(result) = checker.check(entry);
      const auto json = to_json(result);
      if (json.contains("text")) result.text = explanation(json, location);
      output.add_case(json);
    }
    result.exit_code = exit_code(std::vector{result.verdict}, result.orphans.size());
  });
  return result;
}

/// A suite that by default runs ten boxes for 20 steps of A3, with pictures of frames 10 and 20.
class SmallSuite {
 public:
  explicit SmallSuite(std::string scene_name = "box_stack", int frames = 20) : name_(std::move(scene_name)) {
    options.suite = folder_.path() / "golden/suite.toml";
    options.output = folder_.path() / "out";
    std::filesystem::create_directories(folder_.path() / "scenes");
    std::filesystem::copy_file(std::filesystem::path(test::source_folder) / "scenes" / (name_ + ".gltf"),
                               scene());
    // With these settings the weight leaves contacts at rest where they are.
    write_text(options.suite, fmt::format("[defaults]\nframes = {0}\nimages = [10, {0}]\nsize = [160, 90]\n"
                                          "settings = {{ tau = 0.6, kappa = 1 }}\n"
                                          "[[case]]\nscene = \"../scenes/{1}.gltf\"\nalgorithms = [\"a3\"]\n",
                                          frames, name_));
  }

  std::filesystem::path scene() const { return folder_.path() / "scenes" / (name_ + ".gltf"); }
  std::filesystem::path golden(const std::string& file) const { return options.suite.parent_path() / file; }
  std::filesystem::path poses() const { return golden("poses/" + name_ + "/a3.poses"); }
  std::filesystem::path track() const { return golden("poses/" + name_ + "/a3.track"); }
  std::filesystem::path image(int frame) const {
    return golden(fmt::format("images/{}/a3.f{:04}.png", name_, frame));
  }
  std::filesystem::path sidecar() const { return golden("images/" + name_ + "/a3.json"); }
  std::filesystem::path shown(const std::string& file) const {
    return options.output / (name_ + ".a3") / file;
  }
  std::string result_text(const char* file) const { return read_text(options.output / file); }
  SuiteCase entry() const { return read_suite(options.suite).cases.at(0); }

  CheckResult run() { return check(options); }

  /// Approves the results of the last check if its case failed.
  Approval approve_failed(const std::string& reason = "for the test") const {
    return approve({options.suite, options.output, {}, true, reason});
  }
  /// Approves these cases' results of the last check, passed or failed.
  Approval approve_named(const std::vector<std::string>& cases) const {
    return approve({options.suite, options.output, cases, false, "for the test"});
  }

  void make_goldens() {
    run();
    approve_failed();
  }

  void add_to_suite(const std::string& line) const {
    write_text(options.suite, read_text(options.suite) + line + "\n");
  }

  /// Makes the light of the scene's file weaker.
  void change_light() const { replace_in(scene(), "\"intensity\":3.0", "\"intensity\":2.5"); }

  Json sidecar_json() const { return Json::parse(read_text(sidecar())); }
  void change_sidecar(const std::function<void(Json&)>& change) const {
    auto json = sidecar_json();
    change(json);
    write_text(sidecar(), sidecar_text(json));
  }

  /// Changes the red of a pixel of the last golden picture by some levels.
  void change_pixel(int levels) const {
    render::Image picture = render::read_png(image(20));
    std::uint8_t& red = picture.pixel(31, 17)[0];
    red = static_cast<std::uint8_t>(red >= 128 ? red - levels : red + levels);
    render::write_png(picture, image(20));
  }

  /// Notes the present goldens as approved: a golden changed by hand then counts as made by another
  /// simulation or renderer, not as edited.
  void sign() const {
    change_sidecar([&](auto& json) {
      const PoseLog log = read_pose_log(poses());
      auto& noted = json.at("poses");
      noted["first"] = hash_text(log.frames.front().hash);
      noted["last"] = hash_text(log.frames.back().hash);
      noted["log_hash"] = content_hash(read_bytes(poses()));
      noted["track_hash"] = content_hash(read_bytes(track()));
      for (auto& picture : json.at("images"))
        picture["pixels"] = hash_text(hash(render::read_png(image(picture.at("frame")))));
    });
  }

  /// Replaces the golden pictures by those of a renderer with a weaker light.
  void repaint() {
    const std::string text = read_text(scene());
    change_light();
    for (const ImageResult& drawn : run().images)
      write_text(image(drawn.frame), read_text(shown(fmt::format("f{:04}.actual.png", drawn.frame))));
    write_text(scene(), text);
    sign();
  }

  CheckOptions options;

 private:
  std::string name_;
  test::TemporaryFolder folder_;
};

}  // namespace substep::golden
