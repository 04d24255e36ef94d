#include "render/video/frame_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/error.h"

namespace substep::render {
namespace {

constexpr double same = 1e-6;  // of a step: by how much sums of steps and frames miss one another

/// Returns the clock of a run that keeps every `every`-th step; `instant` s are between kept ones at least.
FrameClock clock_of(const FrameTimes& frames, double instant, std::int64_t every) {
  FrameClock clock;
  const auto keep = [&](std::int64_t kept) {
    if (clock.steps.empty() || clock.steps.back() < kept * every) clock.steps.push_back(kept * every);
  };
  for (const double time : frames.times()) {
    const double exact = time / instant;
    auto before = static_cast<std::int64_t>(std::floor(exact + same));
    const double weight = exact - static_cast<double>(before);
    // The step before may already be kept as an earlier frame's second one.
    keep(before);
    const auto at = std::ranges::lower_bound(clock.steps, before * every) - clock.steps.begin();
    clock.places.push_back({static_cast<std::size_t>(at), weight < same ? 0 : weight});
    if (weight >= same) keep(before + 1);
  }
  return clock;
}

bool is_exact(const FrameClock& clock) {
  return std::ranges::all_of(clock.places, [](const FrameClock::Place& place) { return place.weight == 0; });
}

}  // namespace

std::vector<double> FrameTimes::times() const {
  std::vector<double> times;
  const auto last = static_cast<std::int64_t>(std::floor((duration - start) / interval + same));
  for (std::int64_t k = 0; k <= last; ++k) times.push_back(start + static_cast<double>(k) * interval);
  return times;
}

std::size_t FrameClock::frames_of(std::size_t kept) const {
  const auto is_shown = [&](const Place& place) { return place.before + (place.weight > 0 ? 1 : 0) < kept; };
  return static_cast<std::size_t>(std::ranges::partition_point(places, is_shown) - places.begin());
}

std::vector<FrameClock> frame_clocks(const FrameTimes& frames, const std::vector<double>& steps) {
  std::vector<FrameClock> clocks;
  for (const double step : steps) clocks.push_back(clock_of(frames, step, 1));
  if (std::ranges::all_of(clocks, is_exact)) return clocks;
  const double longest = std::ranges::max(steps);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double every = std::round(longest / steps[i]);
    if (std::abs(every * steps[i] - longest) > same * longest) {
      throw Error(fmt::format(
          "steps of {:g} s and {:g} s: frames {:g} s apart lie between them, and the shorter step does not "
          "divide the longer: give a step that does, or one that divides the frames' interval",
          steps[i], longest, frames.interval));
    }
    clocks[i] = clock_of(frames, longest, static_cast<std::int64_t>(every));
  }
  return clocks;
}

std::vector<Coordinates> between(const std::vector<Coordinates>& a, const std::vector<Coordinates>& b,
                                 double weight) {
  std::vector<Coordinates> result;
  result.reserve(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    result.push_back(
        {a[i].linear + weight * (b[i].linear - a[i].linear), a[i].angular.slerp(weight, b[i].angular)});
  }
  return result;
}

std::vector<float> between(const std::vector<float>& a, const std::vector<float>& b, double weight) {
  std::vector<float> result;
  for (std::size_t i = 0; i < a.size(); ++i)
    result.push_back(std::lerp(a[i], b[i], static_cast<float>(weight)));
  return result;
}

std::vector<ContactImpulse> between(const std::vector<ContactImpulse>&, const std::vector<ContactImpulse>& b,
                                    double) {
  return b;
}

double between(double a, double b, double weight) {
  return a + weight * (b - a);
}

}  // namespace substep::render
