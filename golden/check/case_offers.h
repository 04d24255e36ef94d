#pragma once
/// What approving a checked case would copy.

#include "golden/check/case_work.h"

namespace substep {

/// Writes what approving would copy, and finds what forbids it.
void prepare_approval(CaseWork& work, CheckedCase& checked);

}  // namespace substep
