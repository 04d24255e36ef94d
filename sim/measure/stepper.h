#pragma once
/// The interface of simulations that can be measured: a stepper moves the bodies of a scene from step to
/// step. Our algorithms and other physics engines implement it.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

class Stepper {
 public:
  virtual ~Stepper() = default;

  /// Advances by one step h. False when the state is no longer finite; then it is left as it was.
  virtual bool step() = 0;

  /// Returns centres of mass, orientations of the body frames and world velocities of all bodies, in the
  /// scene's order.
  virtual const State& state() const = 0;

  /// Returns the contacts of the last step; nothing where they are not known.
  virtual std::optional<std::vector<ContactImpulse>> contact_impulses() const { return std::nullopt; }

  /// Rows solved so far; 0 where that is not known.
  virtual std::int64_t row_solves() const { return 0; }
};

/// Makes a stepper at the scene's start, with step `settings.step`. Throws Error when the scene cannot be
/// represented: the message says why.
using MakeStepper = std::function<std::unique_ptr<Stepper>(const Scene& scene, const Settings& settings)>;

/// Makes a stepper that plays given states; step() returns false at the last.
std::unique_ptr<Stepper> recorded_stepper(std::vector<State> states);

/// Makes a stepper of one of A1 to A5.
std::unique_ptr<Stepper> algorithm_stepper(const Scene& scene, const Settings& settings);

}  // namespace substep
