#pragma once
/// What can be measured: anything that takes a scene's bodies from step to step. Our algorithms are one kind;
/// a physics engine that is put beside them implements this and nothing more.

#include <cstdint>
#include <functional>
#include <memory>

#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

class Stepper {
 public:
  virtual ~Stepper() = default;

  /// Advances by one step h. False when the state is no longer finite; then it is left as it was.
  virtual bool step() = 0;

  /// Of all bodies of the scene, in its order: centres of mass, orientations of the body frames, velocities
  /// in the world.
  virtual const State& state() const = 0;

  /// Rows solved so far; 0 where that is not known.
  virtual std::int64_t row_solves() const { return 0; }
};

/// Makes a stepper at the scene's start, with step `settings.step`. Throws Error when the scene cannot be
/// represented: the message says why.
using MakeStepper = std::function<std::unique_ptr<Stepper>(const Scene& scene, const Settings& settings)>;

/// One of A1 to A5.
std::unique_ptr<Stepper> algorithm_stepper(const Scene& scene, const Settings& settings);

}  // namespace substep
