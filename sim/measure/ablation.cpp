#include "sim/measure/ablation.h"

#include <utility>

#include "sim/algorithms.h"
#include "sim/math/rotation.h"
#include "sim/measure/measured_run.h"

namespace substep {
namespace {

class Experiment {
 public:
  explicit Experiment(const Approximation& switches) : switches_(switches) {}

  void operator()(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
                  Work& work) {
    const auto [n, usual_m, tau, kappa] = settings.substepping();
    const auto [contact_tau, contact_kappa] = settings.of_contacts();
    const double hs = settings.step / n;
    Constraints& c = problem.c;
    Substeps& substeps = problem.substeps;
    substeps.bias_at_next_frame = switches_.exact_bias();
    stepped_ = q;
    first_ = c;
    set_zero(work.sum);
    clear_impulses(c);
    for (int j = 1; j <= n; ++j) {
      start_substep(problem, v_local);
      add_external(problem, hs, v_local);
      const int m = sweeps_of(problem, usual_m);
      for (int i = 1; i <= m; ++i) {
        for (Block& x : c.blocks) {
          update_stable(problem, x, v_local);
          apply(c, x, solve(c, x, {.tau = tau, .kappa = kappa}, v_local), v_local);
        }
        for (const ContactBatch& x : c.contacts.batches)
          solve_and_apply(c.contacts, x, {.kappa = contact_kappa, .tau = contact_tau}, v_local);
        work.row_solves += c.row_count();
      }
      renew_free_rotation(problem, hs, v_local);
      add(v_local, work.sum);
      step_coordinates(hs, v_local, stepped_);
      if (switches_.unstepped) {
        add(v_local, substeps.offset);
      } else {
        substeps.stepped = stepped_;
      }
      if (j < n) step_problem(problem, hs, v_local, work.sum);
      carry_momenta(problem, hs, v_local);
    }
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i].linear += hs * work.sum[i].linear;
      q[i].angular = switches_.summed_rotation
                         ? compose(q[i].angular, rotation_quaternion(hs * work.sum[i].angular))
                         : stepped_[i].angular;
    }
  }

 private:
  /// Makes J̆ʲ⁺¹ and βʲ⁺¹ of lines 15 and 16, each exact or not.
  void step_problem(Problem& problem, double hs, const VelocityVector& v_local, const VelocityVector& sum) {
    Constraints& c = problem.c;
    if (switches_.bias_update) update_biases(problem, v_local);
    before_ = c;
    formulate(problem, stepped_, hs);
    if (switches_.frozen_jacobian) {
      std::swap(before_, c);
      if (switches_.exact_bias()) take_biases(before_, c);
    } else if (switches_.bias_update) {
      take_biases(before_, c);
    }
    if (switches_.current_jacobian_bias) {
      take_biases(first_, c);
      update_biases(problem, sum);
    }
  }

  static void take_biases(const Constraints& from, Constraints& c) {
    for (std::size_t i = 0; i < c.rows.size(); ++i) c.rows[i].beta = from.rows[i].beta;
    ContactBatches& contacts = c.contacts;
    for (std::size_t i = 0; i < contacts.normals.size(); ++i) {
      contacts.normals[i].row.beta = from.contacts.normals[i].row.beta;
    }
    for (std::size_t i = 0; i < contacts.frictions.size(); ++i) {
      for (int k = 0; k < 2; ++k) {
        contacts.frictions[i].row[k].beta = from.contacts.frictions[i].row[k].beta;
        contacts.frictions[i].reference[k] = from.contacts.frictions[i].reference[k];
      }
    }
    for (std::size_t i = 0; i < contacts.patches.size(); ++i) {
      contacts.patches[i].normal_beta = from.contacts.patches[i].normal_beta;
      contacts.patches[i].beta = from.contacts.patches[i].beta;
      contacts.patches[i].reference = from.contacts.patches[i].reference;
    }
    // Keep the points to which the displacements were followed.
    contacts.touching = from.contacts.touching;
  }

  Approximation switches_;
  CoordinateVector stepped_;
  Constraints first_;   ///< with J̆¹, β¹
  Constraints before_;  ///< of the sub-step that ends
};

}  // namespace

Simulation ablated_simulation(const Scene& scene, Settings settings, const Approximation& approximation) {
  // Contacts made later in a step: A3's normals turn until then, those of frozen rows do not.
  settings.algorithm = approximation.frozen_jacobian ? Algorithm::a4 : Algorithm::a3;
  return {scene, settings, Experiment(approximation)};
}

std::vector<double> ablation_costs(const Scene& scene, int substeps, double horizon) {
  const Settings settings{.step = scene.step, .substeps = substeps};
  const MeasuredRun exact = measured_run(scene, settings, horizon);
  std::vector<double> costs;
  for (const Approximation& approximation : approximations) {
    Simulation simulation = ablated_simulation(scene, settings, approximation);
    costs.push_back(position_difference(measured_run(simulation, horizon), exact));
  }
  return costs;
}

}  // namespace substep
