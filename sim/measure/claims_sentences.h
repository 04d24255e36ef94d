#pragma once
/// The text of each claim: its statement, its settings and the heads of its table.

#include "sim/measure/claims.h"

namespace substep::claims {

/// Number, section, sentence and what is measured; figures and cases are still to come. 1 to 14 are the
/// report's, 15 and 16 are ours.
Claim unmeasured_claim(int number);

}  // namespace substep::claims
