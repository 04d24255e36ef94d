#include <algorithm>
#include <cmath>

#include "sim/geometry/contact.h"
#include "sim/math/sort_nearly_sorted.h"

namespace substep {
namespace {

bool overlap(const Bounds& a, const Bounds& b, int axis) {
  return a.min()[axis] <= b.max()[axis] && b.min()[axis] <= a.max()[axis];
}

/// Enlarges a box by a twentieth of its largest finite side. A resting box stays inside.
Bounds enlarged(const Bounds& box) {
  double largest = 0;
  for (const double side : box.sizes()) {
    if (std::isfinite(side)) largest = std::max(largest, side);
  }
  const Vector3 spare = Vector3::Constant(largest / 20);
  return {box.min() - spare, box.max() + spare};
}

bool has_nan(const Bounds& box) {
  return box.min().hasNaN() || box.max().hasNaN();
}

/// Lanes of equal width along one axis. A box no wider than a lane is kept in the lane of its lower side, so
/// that it reaches at most into the next lane.
struct Lanes {
  int axis = 0;
  double width = 0;
  double first = 0;
  std::uint32_t count = 1;

  /// Returns true for a box a little narrower than a lane, so that rounding cannot make it reach two lanes
  /// further.
  bool hold(const Bounds& box) const {
    return box.max()[axis] - box.min()[axis] <= 0.99 * width && std::isfinite(box.min()[axis]);
  }
  std::uint32_t of(double position) const {
    if (count == 1 || !(position > first)) return 0;
    return static_cast<std::uint32_t>(std::min((position - first) / width, count - 1.0));
  }
  std::uint32_t from(const Bounds& box) const { return std::max(of(box.min()[axis]), 1U) - 1; }
  std::uint32_t to(const Bounds& box) const { return of(box.max()[axis]); }
};

/// Returns lanes a little wider than the box of median width; `widths` is scratch memory.
Lanes make_lanes(int axis, const std::vector<Bounds>& boxes, std::uint32_t most,
                 std::vector<double>& widths) {
  Lanes lanes;
  lanes.axis = axis;
  widths.clear();
  for (const Bounds& box : boxes) {
    const double width = box.max()[axis] - box.min()[axis];
    if (std::isfinite(width)) widths.push_back(width);
  }
  if (widths.empty()) return lanes;
  const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
  std::ranges::nth_element(widths, middle);
  lanes.width = 1.25 * *middle;

  lanes.first = infinity;
  double last = -infinity;
  for (const Bounds& box : boxes) {
    if (!lanes.hold(box)) continue;
    lanes.first = std::min(lanes.first, box.min()[axis]);
    last = std::max(last, box.min()[axis]);
  }
  if (last > lanes.first && lanes.width > 0) {
    lanes.width = std::max(lanes.width, (last - lanes.first) / most);
    lanes.count = static_cast<std::uint32_t>((last - lanes.first) / lanes.width) + 1;
  }
  return lanes;
}

/// Returns the axis along which the centres of the finite boxes spread most.
int axis_of_largest_spread(const std::vector<Bounds>& boxes) {
  Vector3 origin = Vector3::Zero();
  Vector3 sum = Vector3::Zero();
  Vector3 squares = Vector3::Zero();
  double finite = 0;
  for (const Bounds& box : boxes) {
    const Vector3 size = box.sizes();
    if (!size.allFinite()) continue;
    if (finite == 0) origin = box.min();
    const Vector3 middle = box.min() - origin + size / 2;
    sum += middle;
    squares += middle.cwiseProduct(middle);
    ++finite;
  }
  int axis = 0;
  if (finite > 0) (squares - sum.cwiseProduct(sum) / finite).maxCoeff(&axis);
  return axis;
}

}  // namespace

void BroadPhase::sort_along(int axis, const std::vector<Bounds>& boxes) {
  const auto count = static_cast<std::uint32_t>(boxes.size());
  const auto precedes = [](const Entry& a, const Entry& b) {
    return a.lower != b.lower ? a.lower < b.lower : a.box < b.box;
  };
  if (order_.size() != count) {
    order_.clear();
    for (std::uint32_t i = 0; i < count; ++i) order_.push_back({0, i});
  }
  for (Entry& entry : order_) {
    // A box with NaN has no position in an order; the sweep skips it.
    entry.lower = has_nan(boxes[entry.box]) ? infinity : boxes[entry.box].min()[axis];
  }
  sort_nearly_sorted(order_, precedes);  // few entries change their position from one step to the next
}

void BroadPhase::find_pairs(const std::vector<Bounds>& boxes, Pairs& pairs) {
  pairs_tested_ = 0;
  const auto is_inside = [](const Bounds& box, const Bounds& larger) { return larger.contains(box); };
  if (!std::ranges::equal(boxes, enlarged_, is_inside)) {
    enlarged_.resize(boxes.size());
    std::ranges::transform(boxes, enlarged_.begin(), enlarged);
    near_.reserve(pairs.capacity());  // callers reserve `pairs` alone
    sweep(enlarged_, near_);
  }
  pairs.clear();
  for (const auto& [i, j] : near_) {
    if (boxes[i].intersects(boxes[j])) pairs.emplace_back(i, j);
  }
}

void BroadPhase::sweep(const std::vector<Bounds>& boxes, Pairs& pairs) {
  pairs.clear();
  const auto count = static_cast<std::uint32_t>(boxes.size());
  const int sweep = axis_of_largest_spread(boxes);
  sort_along(sweep, boxes);

  // Make about as many lanes as there are boxes; more would only cost memory.
  const auto most = static_cast<std::uint32_t>(std::sqrt(count)) + 1;
  const Lanes rows = make_lanes((sweep + 1) % 3, boxes, most, widths_);
  const Lanes columns = make_lanes((sweep + 2) % 3, boxes, most, widths_);

  // Keep the boxes that the sweep has reached and not yet left in one list per crossing of lanes; the last
  // list has boxes too wide for a lane.
  const std::uint32_t wide = rows.count * columns.count;
  heads_.reserve(most * most + 1);
  heads_.assign(wide + 1, no_index);
  next_.resize(count);
  for (const Entry& entry : order_) {
    const Bounds& box = boxes[entry.box];
    if (has_nan(box)) continue;
    const auto search = [&](std::uint32_t& head) {
      for (std::uint32_t* link = &head; *link != no_index;) {
        const std::uint32_t other = *link;
        ++pairs_tested_;
        if (boxes[other].max()[sweep] < entry.lower) {
          *link = next_[other];
          continue;
        }
        if (overlap(box, boxes[other], rows.axis) && overlap(box, boxes[other], columns.axis)) {
          pairs.push_back(std::minmax(entry.box, other));
        }
        link = &next_[other];
      }
    };
    for (std::uint32_t row = rows.from(box); row <= rows.to(box); ++row) {
      for (std::uint32_t column = columns.from(box); column <= columns.to(box); ++column) {
        search(heads_[row * columns.count + column]);
      }
    }
    search(heads_[wide]);
    const bool fits = rows.hold(box) && columns.hold(box);
    std::uint32_t& head =
        heads_[fits ? rows.of(box.min()[rows.axis]) * columns.count + columns.of(box.min()[columns.axis])
                    : wide];
    next_[entry.box] = head;
    head = entry.box;
  }
  sort_pairs(count, pairs);
}

/// Sorts pairs by their first box, by counting, then by their second among equal first ones.
void BroadPhase::sort_pairs(std::uint32_t count, Pairs& pairs) {
  begins_.assign(count + 1, 0);
  for (const auto& pair : pairs) ++begins_[pair.first + 1];
  for (std::uint32_t i = 0; i < count; ++i) begins_[i + 1] += begins_[i];
  seconds_.reserve(pairs.capacity());
  seconds_.resize(pairs.size());
  for (const auto& pair : pairs) seconds_[begins_[pair.first]++] = pair.second;
  std::uint32_t begin = 0;
  pairs.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t end = begins_[i];  // the loop above has moved it from i's begin to i's end
    std::sort(seconds_.begin() + begin, seconds_.begin() + end);
    for (; begin < end; ++begin) pairs.emplace_back(i, seconds_[begin]);
  }
}

}  // namespace substep
