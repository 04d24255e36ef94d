#pragma once
/// Physics engines that a sweep can run beside our algorithms. None is linked into the library; which there
/// are is decided when the program is built.

#include <string>
#include <vector>

#include "sim/measure/stepper.h"

namespace substep {

struct Peer {
  std::string name;      ///< as sweep files say: "bullet-si"; letters, digits and -
  std::string label;     ///< as figures say: "Bullet SI"
  std::string settings;  ///< what else was set, for captions
  /// Throws Error with the reason where a scene cannot be represented: it is listed as omitted. Reads of the
  /// settings the step, and `iterations` where the engine has such a number. Called from several
  /// threads, one at a time.
  MakeStepper make;
};

/// Empty where none was built.
const std::vector<Peer>& peers();

}  // namespace substep
