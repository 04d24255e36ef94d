#include "sim/measure/invariants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace substep {
namespace {

/// True where no body meets or is joined to one of infinite mass, so that only gravity changes momentum.
bool is_free(const Scene& scene) {
  const auto is_fixed = [&](int body) { return scene.bodies[body].inverse_mass == 0; };
  return std::ranges::none_of(
             scene.joints,
             [&](const Joint& joint) { return is_fixed(joint.body_a) || is_fixed(joint.body_b); }) &&
         std::ranges::none_of(scene.colliders,
                              [&](const Collider& collider) { return is_fixed(collider.body); });
}

}  // namespace

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
    // The second term of Magnus' series, of a velocity that changes evenly from ω₀ to ω₁: h²/12 ω₀ × ω₁.
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

}  // namespace substep
