#include "sim/measure/invariants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/constraints/formulate.h"
#include "sim/model/model.h"

namespace substep {
namespace {

constexpr double bounded_energy = 0.1;  // of energy_scale

/// Whether no body meets or is joined to one of infinite mass: then momentum is gravity's doing alone.
bool is_free(const Scene& scene) {
  const auto is_fixed = [&](int body) { return scene.bodies[body].inverse_mass == 0; };
  return std::ranges::none_of(
             scene.joints,
             [&](const Joint& joint) { return is_fixed(joint.body_a) || is_fixed(joint.body_b); }) &&
         std::ranges::none_of(scene.colliders,
                              [&](const Collider& collider) { return is_fixed(collider.body); });
}

/// Whether no motor and no fixed body that moves can feed energy in. A drive that holds a position is a
/// spring, but for one by mass, which is not told from a motor here.
bool is_undriven(const Scene& scene) {
  return std::ranges::none_of(scene.joints,
                              [](const Joint& joint) {
                                return std::ranges::any_of(joint.drives, [](const JointDrive& drive) {
                                  return drive.acceleration || drive.velocity_target != 0;
                                });
                              }) &&
         std::ranges::none_of(scene.bodies, [](const Body& body) {
           return body.inverse_mass == 0 &&
                  (body.linear_velocity != Vector3::Zero() || body.angular_velocity != Vector3::Zero());
         });
}

/// What taking back the start's own violations can do, J: each moving body is pushed by no more than all of
/// them in a row, against the weight of all.
double energy_of_violations(const Scene& scene, double violation) {
  double weight = 0;
  int moving = 0;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass == 0) continue;
    weight += scene.gravity.norm() / body.inverse_mass;
    ++moving;
  }
  return weight * moving * violation;
}

}  // namespace

Invariants::Invariants(const Scene& scene, const State& start)
    : scene_(scene),
      meter_(scene),
      joints_(scene),
      is_free_(is_free(scene)),
      start_(start),
      energy_(energy(scene, start)),
      momentum_(momentum(scene, start, 0)) {}

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

std::string out_of_bounds(const Scene& scene, const Metrics& metrics) {
  std::string text;
  const auto say = [&text](const char* what, double value, const char* unit, double most) {
    if (value <= most) return;
    text += fmt::format("{}{} {:.3g} {}, above {:.3g} {}", text.empty() ? "" : "; ", what, value, unit, most,
                        unit);
  };
  const double most = bounded_violation * smallest_body_of(scene);
  const State start = initial_state(scene);
  const double gap = joint_gap(scene, start);
  const double depth = PenetrationMeter(scene).depth(start);
  say("joint gap", metrics.joint_gap, "m", gap + most);
  say("penetration", metrics.penetration, "m", depth + most);
  if (is_undriven(scene)) {
    say("energy growth", metrics.energy_growth, "J",
        bounded_energy * energy_scale(scene) + energy_of_violations(scene, gap + depth) +
            energy_of_springs(build_model(scene), start.q));
  }
  return text;
}

}  // namespace substep
