#pragma once
/// Checks cases one after another in this process; what check() and the workers of check_apart() do.

#include <functional>
#include <span>

#include "golden/check/check.h"
#include "golden/check/check_results.h"

namespace substep::golden {

/// What is to be checked.
struct CheckPlan {
  Suite suite;
  CheckOptions options;  ///< with the suite's file
  std::vector<SuiteCase> cases;

  /// Looked for only where all cases are asked for.
  std::vector<std::filesystem::path> orphans() const;
};

/// Reads the suite. Throws Error.
CheckPlan plan_check(const CheckOptions& options);

/// What to do as cases are checked. All are called in the cases' order.
struct CheckListener {
  std::function<void(const SuiteCase&)> before_case;
  std::function<void(const CheckedCase&)> after_case;
};

/// Whatever goes wrong in a case is its result.
void check_cases(std::span<const SuiteCase> cases, const CheckOptions& options, const MadeWith& made_with,
                 const CheckListener& listener);

/// What is drawn with here: the renderer only where a case has pictures, for it need not be there else.
MadeWith made_with_here(const Suite& suite, std::span<const SuiteCase> cases, const CheckOptions& options);

}  // namespace substep::golden
