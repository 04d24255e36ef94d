#pragma once
/// A suite of one short case in a folder of its own, to be checked, broken and approved.

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "golden/approval/approve.h"
#include "golden/check/case_context.h"
#include "golden/check/check.h"
#include "golden/report/case_commands.h"
#include "golden/suite/sidecar.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace substep::golden {

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

/// Throws when there is no such text, so that a test cannot pass by changing nothing.
inline void replace_in(const std::filesystem::path& file, const std::string& old_text,
                       const std::string& new_text) {
  std::string text = read_text(file);
  const auto at = text.find(old_text);
  if (at == std::string::npos) throw std::runtime_error(file.string() + " has no '" + old_text + "'");
  write_text(file, text.replace(at, old_text.size(), new_text));
}

struct CheckResult {
  std::vector<CaseResult> cases;
  std::vector<std::filesystem::path> orphans;

  int exit_code() const {
    std::vector<Verdict> found;
    for (const CaseResult& result : cases) found.push_back(result.verdict);
    return golden::exit_code(found, orphans.size());
  }
};

/// Checks in this process, and keeps the results of the cases.
inline CheckResult check(const CheckOptions& options) {
  CheckResult result;
  check_with(options, [&](const CheckPlan& plan, CheckOutput& output) {
    const MadeWith made_with = made_with_here(plan);
    const ResultsLocation location = location_of({{"suite", plan.suite.file.string()}}, options.output);
    CaseChecker checker(plan.options, made_with);
    for (const SuiteCase& entry : plan.cases) {
      const CheckedCase checked = checker.check(entry);
      const auto json = to_json(checked);
      result.cases.push_back(checked.result);
      if (json.contains("text")) result.cases.back().text = explanation(json, location);
      output.add_case(json);
    }
    if (options.cases.empty()) result.orphans = orphans(plan.suite);
  });
  return result;
}

/// By default ten boxes for 20 steps of A3, pictures of frames 10 and 20.
class SmallSuite {
 public:
  explicit SmallSuite(std::string scene_name = "box_stack", int frames = 20) : name_(std::move(scene_name)) {
    options.suite = folder_.path() / "golden/suite.toml";
    options.output = folder_.path() / "out";
    std::filesystem::create_directories(folder_.path() / "scenes");
    std::filesystem::copy_file(std::filesystem::path(test::source_folder) / "scenes" / (name_ + ".gltf"),
                               scene());
    write_text(
        options.suite,
        "[defaults]\n"
        "frames = " +
            std::to_string(frames) +
            "\n"
            "images = [10, " +
            std::to_string(frames) +
            "]\n"
            "size = [160, 90]\n"
            "settings = { tau = 0.6, kappa = 1 }\n"  // at rest the weight leaves contacts where they are
            "[[case]]\n"
            "scene = \"../scenes/" +
            name_ +
            ".gltf\"\n"
            "algorithms = [\"a3\"]\n");
  }

  std::filesystem::path scene() const { return folder_.path() / "scenes" / (name_ + ".gltf"); }
  std::filesystem::path golden(const std::string& file) const { return options.suite.parent_path() / file; }
  std::filesystem::path poses() const { return golden("poses/" + name_ + "/a3.poses"); }
  std::filesystem::path track() const { return golden("poses/" + name_ + "/a3.track"); }
  std::filesystem::path image(int frame) const {
    return golden("images/" + name_ + "/a3.f00" + std::to_string(frame) + ".png");
  }
  std::filesystem::path sidecar() const { return golden("images/" + name_ + "/a3.json"); }
  std::filesystem::path shown(const std::string& file) const {
    return options.output / (name_ + ".a3") / file;
  }

  CheckResult run() { return check(options); }

  /// To approve what the last check left, whatever it says.
  ApproveOptions approval(const std::string& reason = "for the test") const {
    ApproveOptions result;
    result.suite = options.suite;
    result.output = options.output;
    result.reason = reason;
    return result;
  }

  /// The last check's only case.
  Approval approve_failed(const std::string& reason = "for the test") {
    ApproveOptions failed = approval(reason);
    failed.all_failed = true;
    return approve(failed);
  }

  void make_goldens() {
    run();
    approve_failed();
  }

  /// Notes what the goldens are now as what was approved: a golden changed by hand is then not edited, but
  /// what another simulation or renderer made.
  void sign() const {
    auto json = nlohmann::ordered_json::parse(read_text(sidecar()));
    const PoseLog log = read_pose_log(poses());
    auto& noted = json.at("poses");
    noted["first"] = fmt::format("{:016x}", log.frames.front().hash);
    noted["last"] = fmt::format("{:016x}", log.frames.back().hash);
    noted["log_hash"] = content_hash(read_bytes(poses()));
    noted["track_hash"] = content_hash(read_bytes(track()));
    for (auto& picture : json.at("images")) {
      picture["pixels"] = pixel_hash(render::read_png(image(picture.at("frame"))));
    }
    write_text(sidecar(), sidecar_text(json));
  }

  /// The golden pictures as a renderer with a weaker light makes them.
  void repaint() {
    const std::string text = read_text(scene());
    replace_in(scene(), "\"intensity\":3.0", "\"intensity\":2.5");
    const CheckResult result = run();
    for (const ImageResult& drawn : result.cases.at(0).images) {
      const std::string file = fmt::format("f{:04}.actual.png", drawn.frame);
      std::filesystem::copy_file(shown(file), image(drawn.frame),
                                 std::filesystem::copy_options::overwrite_existing);
    }
    write_text(scene(), text);
    sign();
  }

  CheckOptions options;

 private:
  std::string name_;
  test::TemporaryFolder folder_;
};

}  // namespace substep::golden
