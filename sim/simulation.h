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

/// Steps velocities and coordinates of a formulated problem, as proc1 … proc5 of algorithms.h do.
using Procedure = std::function<void(std::vector<Coordinates>& q, std::vector<Velocity>& v,
                                     const Settings& settings, Problem& problem, Work& work)>;

/// The report of one step.
struct StepReport {
  enum class Status {
    ok,
    least_squares,  ///< A1: redundant rows contradict one another by `residual`; all else is solved
    unsolved,       ///< A1 found no solution to its tolerance, and used the best one: see `residual`
    diverged,       ///< the step gave numbers that are not finite; the state is left as before it
  };
  Status status = Status::ok;
  int contacts = 0;             ///< contact points found by s1
  int rows = 0;                 ///< constraint rows formulated by s2
  std::int64_t row_solves = 0;  ///< rows solved in s3: A1 counts each row once per active set
  int active_sets = 0;          ///< A1: active sets tried, in the island that took most
  double residual = 0;          ///< A1: largest violation of the MLCP, relative to its size
  int contradicting = 0;        ///< A1: rows that are violated by more than rounding
  int diverged_body = 0;        ///< the first body whose numbers are not finite
};

/// The reason for which Simulation::equal_parts() is above one.
inline constexpr std::string_view reason_of_parts =
    "forces of joints make light bodies stiff in the transverse direction";

class Simulation {
 public:
  /// Throws Error when the settings cannot be used or a part of the scene cannot be modelled. With a
  /// `procedure`, for experiments within the repository, sets up frames, rows and blocks for the settings'
  /// algorithm, but steps with `procedure`.
  Simulation(const Scene& scene, const Settings& settings, Procedure procedure = nullptr);

  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  /// Advances by settings().step. Allocates only when there are more contacts than in any step before (A1:
  /// its factors too).
  const StepReport& step();

  const State& state() const;
  /// Returns the impulses of all contact points of the last step, zero ones too, with points at the bodies'
  /// current poses. Empty before the first step.
  std::vector<ContactImpulse> contact_impulses() const;
  /// Returns the settings; in a scene without joints τ and κ are those of contacts.
  const Settings& settings() const;
  const Scene& scene() const;
  std::int64_t steps() const;  ///< taken so far; the time is steps() * settings().step

  /// Returns the largest number of equal parts of a step so far. A1 and A2 take a step in parts where taut
  /// joints make light bodies too stiff in the transverse direction: in each step by the weights that hang on
  /// the joints at the scene's start, and in A1 also after a step in which joints pulled harder. A given
  /// procedure takes a step as one part.
  int equal_parts() const;

  /// Continues from another state at the same time. Throws Error that names a body whose numbers are not
  /// finite or whose quaternion is not of length 1, or says that the scene has another number of bodies.
  void set_state(const State& state);

  /// Returns the parts of the model that this scene needs: "3 locked points; no contacts; no
  /// gyroscopic term".
  std::string modelled() const;

  /// Returns the MLCP of the last step as text that tests can load (A1 only, else empty): of the parts of a
  /// divided step, the first that was not solved, else the last.
  std::string last_problem() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace substep
