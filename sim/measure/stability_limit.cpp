#include "sim/measure/stability_limit.h"

#include <map>

namespace substep {

StabilityLimit stability_limit(const Scene& scene, const Settings& settings, const ReferenceMotion& reference,
                               int most) {
  StabilityLimit limit;
  limit.most = most;
  std::map<int, bool> known;
  const auto is_bounded = [&](int divisions) {
    const auto found = known.find(divisions);
    if (found != known.end()) return found->second;
    ++limit.runs;
    return known[divisions] = measure(scene, divided(settings, divisions), reference, false).bounded;
  };
  // A lucky coarse run does not count: two finer ones must be bounded too.
  int high = 1;
  while (high <= most && !(is_bounded(high) && is_bounded(2 * high) && is_bounded(4 * high))) high *= 2;
  if (high > most) return limit;
  int low = high / 2;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (is_bounded(middle) ? high : low) = middle;
  }
  limit.divisions = high;
  return limit;
}

}  // namespace substep
