#pragma once
/// What approving a checked case would copy.

#include "golden/check/case_context.h"

namespace substep::golden {

/// Writes what approving would copy, and finds what forbids it.
void prepare_approval(CaseContext& work, CheckedCase& checked);

/// Whether the golden track says of each frame what the live one does; its bytes may be deflated otherwise.
bool has_equal_track(const CaseContext& work);

/// Of the track's file as approving leaves it.
std::string approved_track_hash(const CaseContext& work);

}  // namespace substep::golden
