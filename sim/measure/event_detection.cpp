#include "sim/measure/event_detection.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace substep {
namespace {

constexpr double touching = 1e-9;    // m or rad, and their rates: a bound that is met at the start
constexpr double tolerance = 1e-12;  // by which a bound is overstepped or pulls when it switches

}  // namespace

EventDetection::EventDetection(const Model& model, ConstrainedDynamics& dynamics)
    : dynamics_(dynamics), open_model_(model) {
  open_model_.locks.clear();
  open_model_.drives.clear();
  for (const Limit& limit : model.limits) {
    if (!limit.soft && limit.side != Limit::Side::both) bounds_.push_back({limit, false});
  }
  set_up();
}

void EventDetection::start(const CoordinateVector& q, const VelocityVector& v) {
  dynamics_.set_drive_sides(dynamics_.drive_sides_at(q, v));
  hold_bounds_met_at_the_start(q, v);
}

void EventDetection::set_up() {
  std::vector<Limit> held;
  open_model_.limits.clear();
  for (const Bound& bound : bounds_) (bound.held ? held : open_model_.limits).push_back(bound.limit);
  dynamics_.hold(held);
  open_.model = &open_model_;
  open_.contacts = &no_contacts_;
  build_blocks(open_, Joints::rows);
}

void EventDetection::update_margins(const CoordinateVector& q, const VelocityVector& v) {
  formulate(open_, q, 1);
  std::vector<double> rooms(open_model_.limits.size());
  for (const Block& x : open_.c.blocks) rooms[x.source] = -open_.c.rows[x.first].beta;
  const std::vector<double> pushes = dynamics_.pushes(q, v);
  std::size_t held = 0;
  std::size_t open = 0;
  for (Bound& bound : bounds_) {
    const double sign = bound.limit.side == Limit::Side::high ? -1 : 1;
    bound.margin = tolerance + (bound.held ? sign * pushes[held++] : rooms[open++]);
  }
}

void EventDetection::hold_bounds_met_at_the_start(const CoordinateVector& q, const VelocityVector& v) {
  if (bounds_.empty()) return;
  formulate(open_, q, 1);
  for (const Block& x : open_.c.blocks) {
    const Row& row = open_.c.rows[x.first];
    bounds_[x.source].held =
        std::abs(row.beta) < touching && std::abs(row_velocity(row, v[x.a], v[x.b])) < touching;
  }
  set_up();
  // Those that pull are open; one goes at a time, as each changes what the others do.
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    update_margins(q, v);
    const auto least = std::ranges::min_element(bounds_, {}, [](const Bound& bound) {
      return bound.held ? bound.margin : std::numeric_limits<double>::infinity();
    });
    if (!least->held || least->margin >= 0) break;
    least->held = false;
    set_up();
  }
}

bool EventDetection::detect_events(const CoordinateVector& q, const VelocityVector& v) {
  if (dynamics_.drive_sides_at(q, v) != dynamics_.drive_sides()) return true;
  if (bounds_.empty()) return false;
  update_margins(q, v);
  return !std::ranges::all_of(bounds_, [](const Bound& bound) { return bound.margin >= 0; });
}

void EventDetection::apply_events(CoordinateVector& q, VelocityVector& v) {
  dynamics_.set_drive_sides(dynamics_.drive_sides_at(q, v));
  if (bounds_.empty()) return;
  update_margins(q, v);
  for (Bound& bound : bounds_) {
    if (bound.margin < 0) bound.held = !bound.held;
  }
  set_up();
  dynamics_.project(q, v);  // an impact: what closes a bound is lost
}

}  // namespace substep
