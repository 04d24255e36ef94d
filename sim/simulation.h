#pragma once
/// Steps a scene with one of the five algorithms.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

struct Problem;
struct Work;

/// A step's velocities and coordinates from a formulated problem, as proc1 … proc5 of algorithms.h.
using Procedure = std::function<void(std::vector<Coordinates>& q, std::vector<Velocity>& v,
                                     const Settings& settings, Problem& problem, Work& work)>;

/// What one step did.
struct StepReport {
  enum class Status {
    ok,
    least_squares,  ///< A1: redundant rows contradict one another by `residual`; all else is solved
    unsolved,  ///< A1 found no solution to the accuracy asked for: see `residual`; the best one found was
               ///< used
    diverged,  ///< the state is no longer finite; it is left as it was before the step
  };
  Status status = Status::ok;
  int contacts = 0;             ///< contact points found by s1
  int rows = 0;                 ///< constraint rows formulated by s2
  std::int64_t row_solves = 0;  ///< rows solved in s3: A1 counts each row once an active set
  int parts = 1;  ///< that the step was taken in: its equal parts, and more where bodies are struck in it
  int active_sets = 0;    ///< A1: active sets tried
  double residual = 0;    ///< A1: largest violation of the MLCP, relative to its size
  int contradicting = 0;  ///< A1: rows that are violated by more than rounding
  int diverged_body = 0;
};

/// Why Simulation::equal_parts() is more than one.
inline constexpr std::string_view reason_of_parts =
    "forces of joints make light bodies stiff in the transverse direction";

class Simulation {
 public:
  /// Throws Error when the settings cannot be used or the scene needs what is not modelled.
  Simulation(const Scene& scene, const Settings& settings);

  /// For experiments: all is set up as for the settings' algorithm (frames, rows, blocks), but `procedure`
  /// takes its place.
  Simulation(const Scene& scene, const Settings& settings, Procedure procedure);

  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  /// Advances by settings().step. Allocates only when there are more contacts than in any step before (A1:
  /// its factors too).
  const StepReport& step();

  const State& state() const;
  /// Of all contact points of the last step, those that gave nothing too, where the bodies stand now. None
  /// before the first.
  std::vector<ContactImpulse> contact_impulses() const;
  const Settings& settings() const;
  const Scene& scene() const;
  std::int64_t steps() const;  ///< taken so far; the time is steps() * settings().step

  /// Returns how many equal parts a step has had at most: as if the step were so much smaller. More than one
  /// in A1 and A2 where taut joints make light bodies too stiff in the transverse direction for the whole
  /// step: in each step by the weights that the scene's start hangs on them, and in A1 also in a step after
  /// one in which joints pulled harder. A given procedure takes a step as one.
  int equal_parts() const;

  /// Continues from another state (same bodies) at the same time.
  void set_state(const State& state);

  /// What this scene makes the solver build, and what not: "joints: 3 ball; no contacts; no gyroscopic term".
  std::string modelled() const;

  /// The multibody MLCP of the last step as text, for a file that tests can load (A1 only, else empty).
  std::string last_problem() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace substep
