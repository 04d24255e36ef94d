#pragma once
/// Times of a film's frames, and the steps of a run that they lie between.

#include <cstdint>
#include <vector>

#include "sim/model/state.h"

namespace substep::render {

struct FrameTimes {
  double start = 0;            ///< s, of the first frame
  double duration = 5;         ///< s, at or before which the last frame is
  double interval = 1.0 / 30;  ///< s

  std::vector<double> times() const;
};

/// The steps that a run keeps for a film. Runs of one comparison keep the same instants.
struct FrameClock {
  /// A frame's place: `weight` of the way from kept step `before` to the next one.
  struct Place {
    std::size_t before = 0;
    double weight = 0;
  };
  std::vector<std::int64_t> steps;  ///< ascending
  std::vector<Place> places;        ///< of each frame

  /// Number of frames that can be shown with the first `kept` steps.
  std::size_t frames_of(std::size_t kept) const;
};

/// Returns a clock for each step length, s. Where frames lie between steps, all clocks keep multiples of the
/// longest step, so that errors compare one instant with itself. Throws Error where steps do not divide it.
std::vector<FrameClock> frame_clocks(const FrameTimes& frames, const std::vector<double>& steps);

/// Returns what lies between two kept values: positions and numbers linearly, orientations by slerp.
std::vector<Coordinates> between(const std::vector<Coordinates>& a, const std::vector<Coordinates>& b,
                                 double weight);
std::vector<float> between(const std::vector<float>& a, const std::vector<float>& b, double weight);
/// Returns those of the step that leads to `b`.
std::vector<ContactImpulse> between(const std::vector<ContactImpulse>& a,
                                    const std::vector<ContactImpulse>& b, double weight);
double between(double a, double b, double weight);

/// Turns values at kept steps into values at frames.
template <typename Value>
void spread(const FrameClock& clock, std::vector<Value>& values) {
  std::vector<Value> spread_out;
  for (std::size_t k = 0; k < clock.frames_of(values.size()); ++k) {
    const FrameClock::Place& place = clock.places[k];
    const Value& before = values[place.before];
    spread_out.push_back(place.weight == 0 ? before
                                           : between(before, values[place.before + 1], place.weight));
  }
  values = std::move(spread_out);
}

}  // namespace substep::render
