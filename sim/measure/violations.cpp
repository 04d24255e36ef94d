#include "sim/measure/violations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/constraints/formulate.h"
#include "sim/loading/scene_settings.h"
#include "sim/measure/invariants.h"
#include "sim/measure/joint_gap.h"
#include "sim/measure/motion.h"
#include "sim/model/model.h"

namespace substep {
namespace {

using Severity = Violation::Severity;

/// True where nothing can take or store energy: no contacts, drives, springs or stops.
bool is_unbraked(const Model& model) {
  return !model.contacts && model.drives.empty() && std::ranges::all_of(model.limits, [](const Limit& limit) {
    return !limit.soft && limit.side == Limit::Side::both;
  });
}

/// Returns a bound on the energy of correcting the violations of the start, J: each moving body is pushed by
/// at most all of them in a row, against the weight of all.
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

/// Returns the largest momentum of all bodies together with an energy, N·s.
double momentum_scale(const Scene& scene, double energy) {
  double mass = 0;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass > 0) mass += 1 / body.inverse_mass;
  }
  return std::sqrt(2 * mass * energy);
}

}  // namespace

bool is_driven(const Scene& scene) {
  const auto is_motor = [](const JointDrive& drive) {
    return drive.acceleration || drive.velocity_target != 0;
  };
  const auto moves_by_itself = [](const Body& body) {
    return body.inverse_mass == 0 &&
           (body.linear_velocity != Vector3::Zero() || body.angular_velocity != Vector3::Zero());
  };
  return std::ranges::any_of(
             scene.joints, [&](const Joint& joint) { return std::ranges::any_of(joint.drives, is_motor); }) ||
         std::ranges::any_of(scene.bodies, moves_by_itself);
}

std::vector<Violation> violations(const Scene& scene, const Metrics& metrics) {
  std::vector<Violation> result;
  const auto check = [&result](const char* what, double value, const char* unit, double most,
                               Severity severity) {
    if (value <= most) return;
    result.push_back({fmt::format("{} {:.3g} {}, above {:.3g} {}", what, value, unit, most, unit), severity});
  };
  const double most = bounded_violation * smallest_body_of(scene);
  const double size = size_of(scene);
  const State start = initial_state(scene);
  const double gap = joint_gap(scene, start);
  const double depth = PenetrationMeter(scene).depth(start);

  // The largest gap counts once, as the worst that it is.
  if (metrics.joint_gap > gap + size) {
    check("joint gap", metrics.joint_gap, "m", gap + size, Severity::torn);
  } else if (metrics.joint_gap > gap + most) {
    check("joint gap", metrics.joint_gap, "m", gap + most, Severity::unbounded);
  } else {
    check("joint gap", metrics.joint_gap, "m", gap + warned_gap * size, Severity::warning);
  }
  check("penetration", metrics.penetration, "m", depth + most, Severity::unbounded);
  for (const std::string& passage : metrics.passages) result.push_back({passage, Severity::warning});

  const double scale = energy_scale(scene);
  const Model model = build_model(scene);
  if (!is_driven(scene)) {
    check(
        "energy growth", metrics.energy_growth, "J",
        bounded_energy * scale + energy_of_violations(scene, gap + depth) + energy_of_springs(model, start.q),
        Severity::unbounded);
    if (is_unbraked(model)) {
      const bool is_free = model.locks.empty() && model.limits.empty();
      check(is_free ? "energy drift" : "energy loss",
            is_free ? std::max(metrics.energy_growth, -metrics.energy_change) : -metrics.energy_change, "J",
            (is_free ? free_energy : bounded_energy) * scale, Severity::warning);
    }
  }
  const double momentum = momentum_scale(scene, scale);
  check("momentum drift", metrics.momentum.value_or(0), "N·s", free_momentum * momentum, Severity::warning);
  check("angular momentum drift", metrics.angular_momentum.value_or(0), "N·m·s",
        free_momentum * momentum * size / 2, Severity::warning);
  return result;
}

std::vector<Violation> violations(const Scene& scene, const Settings& settings, const Metrics& metrics) {
  std::vector<Violation> result = violations(scene, metrics);
  if (const std::string doubt = doubt_about_substeps(scene, settings); !doubt.empty())
    result.push_back({doubt, Severity::warning});
  const bool is_summed = settings.algorithm == Algorithm::a4 || settings.algorithm == Algorithm::a5;
  if (is_summed && metrics.summed_turn > warned_turn) {
    result.push_back(
        {fmt::format("summed rotation turns a body's momentum by up to {:.2g} rad, above {:g} rad",
                     metrics.summed_turn, warned_turn),
         Severity::warning});
  }
  return result;
}

std::string joined(const std::vector<Violation>& violations) {
  std::string text;
  for (const Violation& violation : violations) {
    text += fmt::format("{}{}", text.empty() ? "" : "; ", violation.text);
  }
  return text;
}

}  // namespace substep
