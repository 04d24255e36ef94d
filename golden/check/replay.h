#pragma once
/// A case run again, step by step, beside its golden run: what a body did around the frame in question.

#include <string>
#include <vector>

#include "golden/suite/suite.h"

namespace substep {

struct ReplayOptions {
  int to = -1;        ///< last frame; −1: the case's last
  int before = 3;     ///< frames shown before it
  std::string focus;  ///< a body's name; empty: the one that differs most
};

/// Text for a person: a table of the body's state with its distance from the golden run, what each step
/// solved, and the other bodies' differences at the last frame. Throws Error for a frame or body that there
/// is not.
std::string replay(const SuiteCase& entry, const ReplayOptions& options);

/// The same as a page that plays the run beside its golden one, with the distance between them over time.
/// Throws Error also where there is no golden track, or it is of other bodies.
std::string replay_page(const SuiteCase& entry, const ReplayOptions& options);

}  // namespace substep
