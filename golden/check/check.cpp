#include "golden/check/check.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "golden/check/case_check.h"
#include "golden/check/check_results.h"
#include "golden/report/junit.h"
#include "golden/report/report.h"
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
  void add(const SuiteCase& entry, CheckedRun&& run) {
    if (matrices_.empty() || matrices_.back().scene != entry.scene.stem().string()) finish();
    if (golden_.empty()) matrices_.push_back({entry.scene.stem().string(), {}, {}, {}});
    matrices_.back().cases.push_back(entry.name);
    // What was not run again is as it was.
    if (!run.live) run.live = run.golden;
    golden_.push_back(std::move(run.golden));
    live_.push_back(std::move(run.live));
  }

  std::vector<DistanceMatrix> take() {
    finish();
    return std::move(matrices_);
  }

 private:
  void finish() {
    if (golden_.empty()) return;
    matrices_.back().before = distances(golden_);
    matrices_.back().after = distances(live_);
    golden_.clear();
    live_.clear();
  }

  static std::vector<double> distances(const std::vector<std::optional<PoseLog>>& logs) {
    std::vector<const PoseLog*> pointers;
    for (const auto& log : logs) pointers.push_back(log ? &*log : nullptr);
    return run_distances(pointers);
  }

  std::vector<DistanceMatrix> matrices_;
  std::vector<std::optional<PoseLog>> golden_;
  std::vector<std::optional<PoseLog>> live_;
};

}  // namespace

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::simulation_changed:
      return "simulation changed";
    case Verdict::renderer_changed:
      return "renderer changed";
    case Verdict::both_changed:
      return "both changed";
    case Verdict::environment:
      return "environment";
    case Verdict::missing:
      return "missing";
    case Verdict::created:
      return "new";
  }
  return "?";
}

std::string_view name(PicturePair::About about) {
  switch (about) {
    case PicturePair::About::renderer:
      return "renderer";
    case PicturePair::About::simulation:
      return "simulation";
    case PicturePair::About::first_visible:
      return "first visible";
    case PicturePair::About::only:
      return "only";
  }
  return "?";
}

int CheckResult::exit_code() const {
  const auto has = [&](auto&& predicate) { return std::any_of(cases.begin(), cases.end(), predicate); };
  const bool differs = has([](const CaseResult& result) {
    return result.verdict != Verdict::pass && result.verdict != Verdict::environment;
  });
  if (differs || !orphans.empty()) return 1;
  return has([](const CaseResult& result) { return result.verdict == Verdict::environment; }) ? 3 : 0;
}

CheckResult check(const CheckOptions& options,
                  const std::function<void(const CaseResult&, int number, int of)>& after_case) {
  const Suite suite = read_suite(options.suite);
  finish_approvals(suite.folder());
  const std::vector<SuiteCase> chosen = part_of(select(suite, options.cases), options.shard);
  CheckResult result;
  result.options = options;
  result.options.suite = suite.file;
  result.made_with = made_with(suite.folder(), options.images);
  std::error_code none;
  fs::create_directories(options.output, none);
  // An interrupted check must not leave the results of the one before as its own.
  fs::remove(results_file(options.output), none);
  Stage stage;
  Distances distances;
  std::vector<CheckedCase> checked;
  for (const SuiteCase& entry : chosen) {
    CheckedRun run = check_case(options, result.made_with, entry, stage.scene(entry.scene));
    checked.push_back(run.checked);
    result.cases.push_back(checked.back().result);
    distances.add(entry, std::move(run));
    if (after_case)
      after_case(result.cases.back(), static_cast<int>(checked.size()), static_cast<int>(chosen.size()));
  }
  if (options.cases.empty() && options.shard.number == 1) result.orphans = orphans(suite);
  result.distances = distances.take();
  const auto results = results_json(result, checked);
  write_results(results, options.output);
  write_junit(results, options.output);
  write_report(results, options.output);
  return result;
}

}  // namespace substep
