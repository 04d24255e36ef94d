#pragma once
/// The runs of sweeps beside the five algorithms: physics engines and our accurate mode. No engine is linked
/// into the program. The build decides which native ones there are, and each is loaded when it is needed;
/// those on npm are commands.

#include <string>
#include <vector>

#include "sim/measure/stepper.h"

namespace substep {

struct Engine {
  std::string name;      ///< as sweep files say: "bullet-si"; letters, digits and -
  std::string label;     ///< as figures say: "Bullet 3.24 SI"
  std::string settings;  ///< what else was set, for captions
  bool is_ours;          ///< the accurate mode: reference_integrator.cpp
  /// Makes a stepper of a scene, with the step and, where the engine has iterations, `iterations` of the
  /// settings. Throws Error where the engine is not installed, with what to install, or where it cannot
  /// represent the scene, which is then listed as omitted. May be called from several threads at once.
  MakeStepper make;
  bool has_iterations = false;  ///< whether it reads Settings::iterations
  /// True where the engine runs in another program as WebAssembly, so that its times cannot be compared.
  bool is_command = false;
};

/// Returns the accurate mode, then the built engines, then those on npm.
const std::vector<Engine>& engines();

}  // namespace substep
