#pragma once
/// Which verdict a checked case gets.
///
/// The order; the first rule that speaks decides:
///
///  1. new, missing      goldens that are not there;
///  2. golden edited     all that fails does so against goldens whose own hash, noted when they were
///  approved,
///                       does not hold: nobody approved them;
///  3. scene changed     the scene's file is another than the goldens were made of, and what is another in it
///                       bears on what fails (motion, pictures or both);
///  4. loading changed   the file is the same, but other masses, places, shapes or meshes are loaded of it;
///  5. simulation, renderer or both changed: what is left; on another renderer than the pictures' own, the
///                       environment.

#include "golden/check/case_context.h"

namespace substep::golden {

/// Finds the logs that are not those that were approved. Before they are compared with anything.
void find_edited_logs(CaseContext& work);

/// Sets verdict and cause.
void decide(CaseContext& work);

}  // namespace substep::golden
