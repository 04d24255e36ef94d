#include "golden/check/check.h"

#include <utility>

#include "golden/check/check_cases.h"
#include "golden/check/check_output.h"
#include "golden/check/check_results.h"
#include "golden/report/case_commands.h"
#include "golden/suite/sidecar.h"
#include "sim/error.h"

namespace substep::golden {

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
  std::vector<Verdict> found;
  for (const CaseResult& result : cases) found.push_back(result.verdict);
  return golden::exit_code(found, orphans.size());
}

CheckResult check(const CheckOptions& options, const std::function<void(const CaseResult&)>& after_case) {
  CheckOutput output(options.output);
  try {
    const CheckPlan plan = plan_check(options);
    CheckResult result;
    result.options = plan.options;
    result.made_with = made_with_here(plan.suite, plan.cases, options);
    output.start(plan.suite, plan.options, plan.cases.size());
    output.set_made_with(to_json(result.made_with));
    const ResultsLocation location = location_of({{"suite", plan.options.suite.string()}}, options.output);
    CheckListener listener;
    listener.after_case = [&](const CheckedCase& checked) {
      auto json = to_json(checked);
      result.cases.push_back(checked.result);
      if (json.contains("text")) result.cases.back().text = explanation(json, location);
      output.add_case(std::move(json));
      if (after_case) after_case(result.cases.back());
    };
    check_cases(plan.cases, plan.options, result.made_with, listener);
    result.orphans = plan.orphans();
    output.finish(result.orphans);
    return result;
  } catch (const Error& error) {
    output.fail(error.what());
    throw;
  }
}

}  // namespace substep::golden
