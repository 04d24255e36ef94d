#pragma once
/// What a sweep can run beside the five algorithms: physics engines, none of which is linked into the
/// program: which native ones there can be is decided when it is built, and each is loaded when it is asked
/// for; those on npm are commands; and our own accurate mode.

#include <string>
#include <vector>

#include "sim/measure/stepper.h"

namespace substep {

struct Engine {
  std::string name;      ///< as sweep files say: "bullet-si"; letters, digits and -
  std::string label;     ///< as figures say: "Bullet 3.24 SI"
  std::string settings;  ///< what else was set, for captions
  bool is_ours;          ///< the accurate mode: reference_integrator.h
  /// Throws Error with the reason where the engine is not installed, with what to install, or a scene
  /// cannot be represented: it is listed as omitted. Reads of the settings the step, and `iterations` where
  /// the engine has such a number. Called from several threads at once.
  MakeStepper make;
  bool has_iterations = false;  ///< whether it reads Settings::iterations
  /// Whether it runs in another program, as WebAssembly: its times are none to put beside others.
  bool is_command = false;
};

/// The accurate mode first, then the engines that were built, then those on npm.
const std::vector<Engine>& engines();

}  // namespace substep
