#include "sim/measure/joint_gap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/constraints/formulate.h"

namespace substep {
namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

bool is_angle(const JointCoordinate& coordinate) {
  using Kind = JointCoordinate::Kind;
  return coordinate.kind == Kind::twist || coordinate.kind == Kind::cone || coordinate.kind == Kind::turn;
}

/// The coordinate that is 0 while the lock holds.
JointCoordinate coordinate_of(const Lock& lock) {
  using Kind = JointCoordinate::Kind;
  switch (lock.kind) {
    case Lock::Kind::point:
      return {Kind::distance, 0};
    case Lock::Kind::line:
      return {Kind::radius, lock.axis};
    case Lock::Kind::direction:
      return {Kind::cone, lock.axis};
    case Lock::Kind::orientation:
      break;
  }
  return {Kind::turn, 0};
}

/// The largest radius of gyration of the body about a point of its frame, m.
double gyration(const Model& model, int body, const Vector3& point) {
  const double squared = model.inertia[body].maxCoeff() * model.masses[body].inverse_mass;
  return std::sqrt(squared + point.squaredNorm());
}

double lever_of(const Model& model, const Attachment& at) {
  double lever = unlimited;
  if (moves(model.masses[at.a])) lever = std::min(lever, gyration(model, at.a, at.frame_a.position));
  if (moves(model.masses[at.b])) lever = std::min(lever, gyration(model, at.b, at.frame_b.position));
  return std::isfinite(lever) ? lever : 0;
}

}  // namespace

JointGapMeter::JointGapMeter(const Scene& scene) {
  const Model model = build_model(scene);
  const auto add = [&](const Attachment& at, const JointCoordinate& coordinate, double low, double high) {
    held_.push_back({at, coordinate, low, high, is_angle(coordinate) ? lever_of(model, at) : 1});
  };
  for (const Lock& lock : model.locks) add(lock.at, coordinate_of(lock), 0, 0);
  for (const Limit& limit : model.limits) {
    if (limit.soft) continue;
    add(limit.at, limit.coordinate, limit.side == Limit::Side::high ? -unlimited : limit.bound,
        limit.side == Limit::Side::low ? unlimited : limit.bound);
  }
}

double JointGapMeter::gap(const State& state) const {
  double largest = 0;
  for (const Held& held : held_) {
    const double value = value_of(held.coordinate, held.at, state.q);
    largest = std::max(largest, held.scale * std::max(held.low - value, value - held.high));
  }
  return largest;
}

double joint_gap(const Scene& scene, const State& state) {
  return JointGapMeter(scene).gap(state);
}

}  // namespace substep
