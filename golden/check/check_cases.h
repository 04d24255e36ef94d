#pragma once
/// Checks cases one after another in this process: what check() and the workers of check_apart() do.

#include <functional>
#include <span>

#include "golden/check/check.h"
#include "golden/check/check_results.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// The cases of a check.
struct CheckPlan {
  Suite suite;
  CheckOptions options;  ///< with the suite's file
  std::vector<SuiteCase> cases;
};

/// Reads the suite, calls `run`, and writes results and report. Throws Error.
void check_with(const CheckOptions& options, const std::function<void(const CheckPlan&, CheckOutput&)>& run);

/// Functions that are called as cases are checked, in the cases' order.
struct CheckListener {
  std::function<void(const SuiteCase&)> before_case;
  std::function<void(const CheckedCase&)> after_case;
};

/// Checks the cases. Errors in a case become its verdict; the other cases are checked.
void check_cases(std::span<const SuiteCase> cases, const CheckOptions& options, const MadeWith& made_with,
                 const CheckListener& listener);

/// Checks a case, and prepares its approval.
CheckedCase check_case(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry,
                       const Scene& scene);

/// Returns the result of a case that could not be checked.
CheckedCase failed_case(const CheckOptions& options, const SuiteCase& entry, const std::string& why);

/// Returns what cases are made with here. Starts the renderer only where a case has pictures.
MadeWith made_with_here(const CheckPlan& plan);

}  // namespace substep::golden
