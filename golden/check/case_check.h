#pragma once
/// Checks one case of a suite: what check() does for each.

#include <memory>
#include <optional>

#include "golden/check/check.h"
#include "golden/check/check_results.h"
#include "golden/compare/track.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// A case checked, with what approving would copy.
CheckedCase check_case(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry,
                       const Scene& scene);

/// The result of a case that could not be checked.
CheckedCase failed_case(const CheckOptions& options, const SuiteCase& entry, const std::string& why);

}  // namespace substep::golden
