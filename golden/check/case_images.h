#pragma once
/// The pictures of a case: golden poses against golden pictures, which tells what the renderer changed, and
/// against live poses, which shows what the simulation changed.

#include "golden/check/case_context.h"

namespace substep::golden {

/// After the poses, where they are checked. Writes the pictures that differ into the case's folder.
void check_images(CaseContext& work);

}  // namespace substep::golden
