#include "golden/check/check.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <new>

#include "golden/check/case_context.h"
#include "golden/report/case_commands.h"
#include "golden/suite/sidecar.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"

namespace substep::golden {

int CheckResult::exit_code() const {
  std::vector<Verdict> found;
  for (const CaseResult& result : cases) found.push_back(result.verdict);
  return golden::exit_code(found, orphans.size());
}

CheckResult check(const CheckOptions& options) {
  CheckResult result;
  check_with(options, [&](const CheckPlan& plan, CheckOutput& output) {
    const MadeWith made_with = made_with_here(plan);
    output.set_made_with(to_json(made_with));
    const ResultsLocation location = location_of({{"suite", plan.suite.file.string()}}, options.output);
    CheckListener listener;
    listener.after_case = [&](const CheckedCase& checked) {
      const auto json = to_json(checked);
      result.cases.push_back(checked.result);
      if (json.contains("text")) result.cases.back().text = explanation(json, location);
      output.add_case(json);
    };
    check_cases(plan.cases, plan.options, made_with, listener);
    if (options.cases.empty()) result.orphans = orphans(plan.suite);
  });
  return result;
}

void check_with(const CheckOptions& options, const std::function<void(const CheckPlan&, CheckOutput&)>& run) {
  CheckOutput output(options.output);
  try {
    CheckPlan plan{read_suite(options.suite), options, {}};
    plan.options.suite = plan.suite.file;
    plan.cases = select(plan.suite, options.cases);
    output.start(plan.suite, plan.options, plan.cases.size());
    run(plan, output);
    // A check of some cases does not look for orphans.
    output.finish(options.cases.empty() ? orphans(plan.suite) : std::vector<std::filesystem::path>());
  } catch (const Error& error) {
    output.fail(error.what());
    throw;
  }
}

void check_cases(std::span<const SuiteCase> cases, const CheckOptions& options, const MadeWith& made_with,
                 const CheckListener& listener) {
  // Cases of one scene follow each other: it is loaded once.
  std::filesystem::path scene_file;
  std::unique_ptr<Scene> scene;
  for (const SuiteCase& entry : cases) {
    if (listener.before_case) listener.before_case(entry);
    CheckedCase checked;
    try {
      if (!scene || scene_file != entry.scene) {
        scene = nullptr;
        scene = std::make_unique<Scene>(load_scene(entry.scene));
        scene_file = entry.scene;
      }
      checked = check_case(options, made_with, entry, *scene);
    } catch (const std::bad_alloc&) {
      checked = failed_case(options, entry, "there is not enough memory for it");
    } catch (const std::exception& error) {
      checked = failed_case(options, entry, error.what());
    }
    if (listener.after_case) listener.after_case(checked);
  }
}

MadeWith made_with_here(const CheckPlan& plan) {
  const bool has_pictures = std::any_of(plan.cases.begin(), plan.cases.end(),
                                        [](const SuiteCase& entry) { return !entry.images.empty(); });
  return made_with(plan.suite.folder(), plan.options.images && has_pictures);
}

}  // namespace substep::golden
