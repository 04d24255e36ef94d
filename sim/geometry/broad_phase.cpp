#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/geometry/contact.h"

namespace substep {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

bool overlap(const Bounds& a, const Bounds& b, int axis) {
  return a.lower[axis] <= b.upper[axis] && b.lower[axis] <= a.upper[axis];
}

}  // namespace

void BroadPhase::find_pairs(const std::vector<Bounds>& boxes,
                            std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
  pairs.clear();
  const auto count = static_cast<std::uint32_t>(boxes.size());

  // The spread of the middles of the boxes that have one.
  Vector3 sum = Vector3::Zero();
  Vector3 squares = Vector3::Zero();
  Vector3 origin = Vector3::Zero();
  double finite = 0;
  order_.clear();
  widths_.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    const Bounds& box = boxes[i];
    if (box.lower.hasNaN() || box.upper.hasNaN()) continue;  // overlaps nothing, and cannot be sorted
    order_.push_back({0, i});
    const Vector3 size = box.upper - box.lower;
    if (!size.allFinite()) continue;
    if (finite == 0) origin = box.lower;
    const Vector3 middle = box.lower - origin + size / 2;
    sum += middle;
    squares += middle.cwiseProduct(middle);
    ++finite;
    widths_.push_back(size);
  }
  Vector3 spread = Vector3::Zero();
  if (finite > 0) spread = squares - sum.cwiseProduct(sum) / finite;
  int sweep = 0;
  spread.maxCoeff(&sweep);
  spread[sweep] = -std::numeric_limits<double>::infinity();
  int across = 0;
  spread.maxCoeff(&across);

  for (Entry& entry : order_) entry.lower = boxes[entry.box].lower[sweep];
  std::ranges::sort(order_, [](const Entry& a, const Entry& b) {
    return a.lower != b.lower ? a.lower < b.lower : a.box < b.box;
  });

  // Lanes along the second axis, each twice as wide as the box in the middle of the order of widths. A box no
  // wider than a lane is kept in the lane of its lower side, so that it reaches one lane further at most; the
  // others are kept together.
  double lane_width = 0;
  double first_lane = 0;
  std::uint32_t lanes = 1;
  if (!widths_.empty()) {
    const auto middle = widths_.begin() + static_cast<std::ptrdiff_t>(widths_.size() / 2);
    std::ranges::nth_element(widths_, middle, {}, [&](const Vector3& size) { return size[across]; });
    lane_width = 2 * (*middle)[across];
  }
  const auto is_wide = [&](const Bounds& box) {
    const double width = box.upper[across] - box.lower[across];
    return !(width <= lane_width) || !std::isfinite(box.lower[across]);
  };
  double last = -std::numeric_limits<double>::infinity();
  first_lane = std::numeric_limits<double>::infinity();
  for (const Entry& entry : order_) {
    if (is_wide(boxes[entry.box])) continue;
    first_lane = std::min(first_lane, boxes[entry.box].lower[across]);
    last = std::max(last, boxes[entry.box].lower[across]);
  }
  if (last > first_lane && lane_width > 0) {
    // More lanes than boxes would only cost memory.
    lane_width = std::max(lane_width, (last - first_lane) / (count + 1.0));
    lanes = static_cast<std::uint32_t>((last - first_lane) / lane_width) + 1;
  }
  const auto lane_of = [&](double position) -> std::uint32_t {
    if (lanes == 1 || !(position > first_lane)) return 0;
    return static_cast<std::uint32_t>(std::min((position - first_lane) / lane_width, lanes - 1.0));
  };

  // The boxes that the sweep has reached and not yet left, as one list per lane; the last is of wide boxes.
  heads_.assign(lanes + 1, none);
  next_.resize(count);
  const int third = 3 - sweep - across;
  for (const Entry& entry : order_) {
    const Bounds& box = boxes[entry.box];
    const auto search = [&](std::uint32_t& head) {
      for (std::uint32_t* link = &head; *link != none;) {
        const std::uint32_t other = *link;
        if (boxes[other].upper[sweep] < entry.lower) {
          *link = next_[other];
          continue;
        }
        if (overlap(box, boxes[other], across) && overlap(box, boxes[other], third)) {
          pairs.push_back(std::minmax(entry.box, other));
        }
        link = &next_[other];
      }
    };
    const std::uint32_t from = lane_of(box.lower[across]);
    const std::uint32_t to = lane_of(box.upper[across]);
    for (std::uint32_t lane = from > 0 ? from - 1 : 0; lane <= to; ++lane) search(heads_[lane]);
    search(heads_[lanes]);
    std::uint32_t& head = is_wide(box) ? heads_[lanes] : heads_[from];
    next_[entry.box] = head;
    head = entry.box;
  }

  // By the first of each pair, counting; then by the second, within the few that share the first.
  begins_.assign(count + 1, 0);
  for (const auto& pair : pairs) ++begins_[pair.first + 1];
  for (std::uint32_t i = 0; i < count; ++i) begins_[i + 1] += begins_[i];
  seconds_.resize(pairs.size());
  for (const auto& pair : pairs) seconds_[begins_[pair.first]++] = pair.second;
  std::uint32_t begin = 0;
  pairs.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t end = begins_[i];  // counted up to the end of i's by the loop above
    std::sort(seconds_.begin() + begin, seconds_.begin() + end);
    for (; begin < end; ++begin) pairs.emplace_back(i, seconds_[begin]);
  }
}

}  // namespace substep
