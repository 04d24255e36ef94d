#include "golden/check/check_cases.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <utility>

#include "golden/check/case_check.h"
#include "golden/suite/approval_journal.h"
#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// Cases of one scene follow each other: it is loaded once.
class Stage {
 public:
  const Scene& scene(const fs::path& file) {
    if (!scene_ || scene_file_ != file) {
      scene_ = nullptr;
      scene_ = std::make_unique<Scene>(load_scene(file));
      scene_file_ = file;
    }
    return *scene_;
  }

 private:
  fs::path scene_file_;
  std::unique_ptr<Scene> scene_;
};

/// The logs of the cases of one scene, for their distances.
class Distances {
 public:
  explicit Distances(const CheckListener& listener) : listener_(listener) {}

  void add(const SuiteCase& entry, CheckedRun&& run) {
    if (matrix_.scene != entry.scene.stem().string()) finish();
    matrix_.scene = entry.scene.stem().string();
    matrix_.cases.push_back(entry.name);
    // What was not run again is as it was.
    if (!run.live) run.live = run.golden;
    golden_.push_back(std::move(run.golden));
    live_.push_back(std::move(run.live));
  }

  void finish() {
    if (golden_.empty()) return;
    matrix_.before = distances(golden_);
    matrix_.after = distances(live_);
    if (listener_.after_scene) listener_.after_scene(matrix_);
    matrix_ = {};
    golden_.clear();
    live_.clear();
  }

 private:
  static std::vector<double> distances(const std::vector<std::optional<PoseLog>>& logs) {
    std::vector<const PoseLog*> pointers;
    for (const auto& log : logs) pointers.push_back(log ? &*log : nullptr);
    return run_distances(pointers);
  }

  const CheckListener& listener_;
  DistanceMatrix matrix_;
  std::vector<std::optional<PoseLog>> golden_;
  std::vector<std::optional<PoseLog>> live_;
};

}  // namespace

CheckPlan plan_check(const CheckOptions& options) {
  CheckPlan plan{read_suite(options.suite), options, {}};
  finish_approvals(plan.suite.folder());
  plan.options.suite = plan.suite.file;
  plan.cases = part_of(select(plan.suite, options.cases), options.shard);
  return plan;
}

std::vector<fs::path> CheckPlan::orphans() const {
  if (!options.cases.empty() || options.shard.number != 1) return {};
  return substep::orphans(suite);
}

void check_cases(std::span<const SuiteCase> cases, const CheckOptions& options, const MadeWith& made_with,
                 const CheckListener& listener) {
  Stage stage;
  Distances distances(listener);
  for (const SuiteCase& entry : cases) {
    if (listener.before_case) listener.before_case(entry);
    CheckedRun run;
    try {
      run = check_case(options, made_with, entry, stage.scene(entry.scene));
    } catch (const std::bad_alloc&) {
      run.checked = failed_case(options, entry, "there is not enough memory for it");
    } catch (const std::exception& error) {
      run.checked = failed_case(options, entry, error.what());
    }
    if (listener.after_case) listener.after_case(run.checked);
    distances.add(entry, std::move(run));
  }
  distances.finish();
}

MadeWith made_with_here(const Suite& suite, std::span<const SuiteCase> cases, const CheckOptions& options) {
  const bool has_pictures =
      std::any_of(cases.begin(), cases.end(), [](const SuiteCase& entry) { return !entry.images.empty(); });
  return made_with(suite.folder(), options.images && has_pictures);
}

}  // namespace substep
