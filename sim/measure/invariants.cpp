#include "sim/measure/invariants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "sim/constraints/formulate.h"
#include "sim/measure/metrics.h"
#include "sim/measure/motion.h"

namespace substep {
namespace {

/// Returns the coordinate that is 0 while the lock holds.
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

/// Returns the smaller of the moving bodies' largest radii of gyration about the joint, m.
double lever_of(const Model& model, const Attachment& at) {
  double lever = infinity;
  for (const auto& [body, frame] : {std::pair(at.a, at.frame_a), std::pair(at.b, at.frame_b)}) {
    if (!moves(model.masses[body])) continue;
    const double squared = model.inertia[body].maxCoeff() * model.masses[body].inverse_mass;
    lever = std::min(lever, std::sqrt(squared + frame.position.squaredNorm()));
  }
  return std::isfinite(lever) ? lever : 0;
}

/// Returns true if no body of infinite mass has a joint or a collider, so that only gravity changes momentum.
bool is_free(const Scene& scene) {
  const auto is_fixed = [&](int body) { return scene.bodies[body].inverse_mass == 0; };
  return std::ranges::none_of(
             scene.joints,
             [&](const Joint& joint) { return is_fixed(joint.body_a) || is_fixed(joint.body_b); }) &&
         std::ranges::none_of(scene.colliders,
                              [&](const Collider& collider) { return is_fixed(collider.body); });
}

}  // namespace

double energy(const Scene& scene, const State& state) {
  double sum = 0;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass > 0) {
      sum += 0.5 / body.inverse_mass * state.v[i].linear.squaredNorm();
      sum -= body.gravity_factor / body.inverse_mass * scene.gravity.dot(state.q[i].linear);
    }
    const Vector3 local = state.q[i].angular.conjugate() * state.v[i].angular;
    for (int axis = 0; axis < 3; ++axis) {
      if (body.inverse_inertia[axis] > 0) sum += 0.5 * local[axis] * local[axis] / body.inverse_inertia[axis];
    }
  }
  return sum;
}

Momentum momentum(const Scene& scene, const State& state, double time) {
  double mass = 0;
  Vector3 centre = Vector3::Zero();
  Momentum sum;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    const double m = 1 / body.inverse_mass;
    mass += m;
    centre += m * state.q[i].linear;
    sum.linear += m * (state.v[i].linear - time * body.gravity_factor * scene.gravity);
  }
  if (mass > 0) centre /= mass;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    Vector3 spin = state.q[i].angular.conjugate() * state.v[i].angular;
    for (int axis = 0; axis < 3; ++axis) {
      spin[axis] = body.inverse_inertia[axis] > 0 ? spin[axis] / body.inverse_inertia[axis] : 0;
    }
    const Vector3 arm = state.q[i].linear - centre;
    sum.angular += state.q[i].angular * spin + arm.cross(state.v[i].linear) / body.inverse_mass;
  }
  return sum;
}

bool is_rigid(const Model& model) {
  return !model.contacts && model.drives.empty() && std::ranges::all_of(model.limits, [](const Limit& limit) {
    return !limit.soft && limit.side == Limit::Side::both;
  });
}

double moved(const Scene& scene, const State& start, const State& state) {
  double largest = 0;
  for (std::size_t i = 1; i < state.q.size(); ++i) {
    if (scene.bodies[i].inverse_mass > 0)
      largest = std::max(largest, (state.q[i].linear - start.q[i].linear).norm());
  }
  return largest;
}

double energy_scale(const Scene& scene) {
  Scene weightless = scene;
  weightless.gravity.setZero();
  double scale = energy(weightless, initial_state(scene));
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass > 0) scale += scene.gravity.norm() * size_of(scene) / body.inverse_mass;
  }
  return scale;
}

JointGapMeter::JointGapMeter(const Scene& scene) {
  const Model model = build_model(scene);
  const auto add = [&](const Attachment& at, const JointCoordinate& coordinate, double low, double high) {
    using Kind = JointCoordinate::Kind;
    const Kind kind = coordinate.kind;
    const bool is_angle = kind == Kind::twist || kind == Kind::cone || kind == Kind::turn;
    held_.push_back({at, coordinate, low, high, is_angle ? lever_of(model, at) : 1});
  };
  for (const Lock& lock : model.locks) add(lock.at, coordinate_of(lock), 0, 0);
  for (const Limit& limit : model.limits) {
    if (limit.soft) continue;
    add(limit.at, limit.coordinate, limit.side == Limit::Side::high ? -infinity : limit.bound,
        limit.side == Limit::Side::low ? infinity : limit.bound);
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

double PenetrationMeter::depth(const State& state) {
  return std::ranges::max(depths(state));
}

/// Returns the overlap of a kept patch at its deepest corner, m.
static double depth_of(const PatchShape& patch, const Coordinates& a, const Coordinates& b) {
  const Matrix3 b_in_a = (a.angular.conjugate() * b.angular).toRotationMatrix();
  const Vector3 apart = b.angular.conjugate() * (a.linear + a.angular * patch.arm_a - b.linear) - patch.arm_b;
  const Vector3 turned = patch.axes_in_b.transpose() * b_in_a.transpose() * patch.axes_in_a.col(0);
  double depth = 0;
  for (const auto& [x, y] : std::span(patch.corner, patch.corners)) {
    const double gap = patch.axes_in_b.col(0).dot(apart) + patch.left[0] + (patch.tilt[0] - turned[1]) * x +
                       (patch.tilt[1] - turned[2]) * y;
    depth = std::max(depth, -gap);
  }
  return depth;
}

std::vector<double> PenetrationMeter::depths(const State& state) {
  std::vector<double> deepest(state.q.size(), 0);
  if (!model_.contacts) return deepest;
  const auto add = [&](int a, int b, double depth) {
    for (const int body : {a, b}) deepest[body] = std::max(deepest[body], depth);
  };
  for (const Contact& contact : finder_.find(state, 0, 1)) {
    const Coordinates& a = state.q[contact.a];
    const Coordinates& b = state.q[contact.b];
    const Vector3 apart = a.linear + a.angular * contact.arm_a - (b.linear + b.angular * contact.arm_b);
    add(contact.a, contact.b, -apart.dot(b.angular * contact.normal_b));
  }
  for (const PatchShape& patch : finder_.kept_patches())
    add(patch.a, patch.b, depth_of(patch, state.q[patch.a], state.q[patch.b]));
  return deepest;
}

Invariants::Invariants(const Scene& scene, const State& start)
    : scene_(scene),
      meter_(scene),
      joints_(scene),
      passage_(scene, start),
      is_free_(is_free(scene)),
      start_(start),
      energy_(energy(scene, start)),
      momentum_(momentum(scene, start, 0)) {
  for (std::size_t i = 0; i < start.q.size(); ++i)
    local_spins_.push_back(start.q[i].angular.conjugate() * start.v[i].angular);
  summed_turns_.assign(start.q.size(), Vector3::Zero());
}

void Invariants::add(const State& state, double time, Metrics& metrics) {
  metrics.joint_gap = std::max(metrics.joint_gap, joints_.gap(state));
  metrics.penetration = std::max(metrics.penetration, meter_.depth(state));
  metrics.energy_change = energy(scene_, state) - energy_;
  metrics.energy_growth = std::max(metrics.energy_growth, metrics.energy_change);
  metrics.moved = std::max(metrics.moved, moved(scene_, start_, state));
  if (!is_free_) return;
  const Momentum now = momentum(scene_, state, time);
  metrics.momentum = std::max(metrics.momentum.value_or(0), (now.linear - momentum_.linear).norm());
  metrics.angular_momentum =
      std::max(metrics.angular_momentum.value_or(0), (now.angular - momentum_.angular).norm());
}

void Invariants::follow(const State& state, double step, Metrics& metrics) {
  for (std::size_t i = 1; i < state.q.size(); ++i) {
    // Add the second term of Magnus' series for a velocity that changes linearly from ω₀ to ω₁: h²/12 ω₀×ω₁.
    const Vector3 spin = state.q[i].angular.conjugate() * state.v[i].angular;
    summed_turns_[i] += state.q[i].angular * (step * step / 12 * local_spins_[i].cross(spin));
    local_spins_[i] = spin;
    metrics.summed_turn = std::max(metrics.summed_turn, summed_turns_[i].norm());
  }
  passage_.add(state, step);
  if (passage_.passages().size() == metrics.passages.size()) return;
  metrics.passages.clear();
  for (const auto& [one, other] : passage_.passages()) {
    metrics.passages.push_back(
        fmt::format("'{}' passes through '{}'", scene_.bodies[other].name, scene_.bodies[one].name));
  }
}

}  // namespace substep
