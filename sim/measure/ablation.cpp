#include "sim/measure/ablation.h"

#include <utility>

#include "sim/algorithms.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// A approximation as switches over the listing of A3.
struct Approximations {
  explicit Approximations(Approximation approximation)
      : frozen_jacobian(approximation == Approximation::frozen_jacobian ||
                        approximation == Approximation::all_of_a4),
        bias_update(approximation == Approximation::bias_update || approximation == Approximation::all_of_a4),
        current_jacobian_bias(approximation == Approximation::current_jacobian_bias),
        summed_rotation(approximation == Approximation::summed_rotation ||
                        approximation == Approximation::all_of_a4),
        unstepped(approximation == Approximation::all_of_a4) {}

  bool exact_bias() const { return !bias_update && !current_jacobian_bias; }

  bool frozen_jacobian;
  bool bias_update;
  bool current_jacobian_bias;
  bool summed_rotation;
  bool unstepped;  ///< 'stable' blocks know the coordinates as the start and the sum, as in A4
};

class Experiment {
 public:
  explicit Experiment(Approximation approximation) : approximations_(approximation) {}

  void operator()(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
                  Work& work) {
    const auto [n, usual_m, tau, kappa] = settings.substepping();
    const auto [contact_tau, contact_kappa] = settings.of_contacts();
    const double hs = settings.step / n;
    Constraints& c = problem.c;
    Substeps& substeps = problem.substeps;
    substeps.bias_at_next_frame = approximations_.exact_bias();
    stepped_ = q;
    keep(first_, c);
    set_zero(work.sum);
    clear_impulses(c);
    for (int j = 1; j <= n; ++j) {
      start_substep(problem, v_local);
      add_external(*problem.model, hs, v_local);
      const int m = sweeps_of(problem, usual_m);
      for (int i = 1; i <= m; ++i) {
        for (Block& x : c.blocks) {
          update_stable(problem, x, v_local);
          apply(c, x, solve(c, x, kappa, tau, v_local), v_local);
        }
        for (const ContactBatch& x : c.contacts.batches)
          solve_and_apply(c.contacts, x, {.kappa = contact_kappa, .tau = contact_tau}, v_local);
        work.row_solves += c.row_count();
      }
      add(v_local, work.sum);
      step_coordinates(hs, v_local, stepped_);
      if (approximations_.unstepped) {
        add(v_local, substeps.offset);
      } else {
        substeps.stepped = stepped_;
      }
      if (j < n) step_problem(problem, hs, v_local, work.sum);
    }
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i].linear += hs * work.sum[i].linear;
      q[i].angular = approximations_.summed_rotation
                         ? compose(q[i].angular, rotation_quaternion(hs * work.sum[i].angular))
                         : stepped_[i].angular;
    }
  }

 private:
  /// The constraints that a formulation overwrites.
  struct Kept {
    std::vector<Row> rows;
    std::vector<Matrix3> effective_masses;
    std::vector<NormalRow> normals;
    std::vector<FrictionRows> frictions;
    std::vector<TouchingPoint> touching;
    std::vector<ContactDirections> directions;
    std::vector<Coupling> couplings;
    std::vector<Patch> patches;
    std::vector<PatchCorner> patch_corners;
    std::vector<RestitutionRow> restitutions;
  };

  static void keep(Kept& kept, const Constraints& c) {
    kept.rows = c.rows;
    kept.effective_masses = c.effective_masses;
    kept.normals = c.contacts.normals;
    kept.frictions = c.contacts.frictions;
    kept.touching = c.contacts.touching;
    kept.directions = c.contacts.directions;
    kept.couplings = c.contacts.couplings;
    kept.patches = c.contacts.patches;
    kept.patch_corners = c.contacts.patch_corners;
    kept.restitutions = c.contacts.restitutions;
  }

  static void swap(Kept& kept, Constraints& c) {
    std::swap(kept.rows, c.rows);
    std::swap(kept.effective_masses, c.effective_masses);
    std::swap(kept.normals, c.contacts.normals);
    std::swap(kept.frictions, c.contacts.frictions);
    std::swap(kept.touching, c.contacts.touching);
    std::swap(kept.directions, c.contacts.directions);
    std::swap(kept.couplings, c.contacts.couplings);
    std::swap(kept.patches, c.contacts.patches);
    std::swap(kept.patch_corners, c.contacts.patch_corners);
    std::swap(kept.restitutions, c.contacts.restitutions);
  }

  /// Lines 15 and 16: J̆ʲ⁺¹ and βʲ⁺¹, each exact or not.
  void step_problem(Problem& problem, double hs, const VelocityVector& v_local, const VelocityVector& sum) {
    Constraints& c = problem.c;
    if (approximations_.bias_update) update_biases(problem, v_local);
    keep(before_, c);
    formulate(problem, stepped_, hs);
    if (approximations_.frozen_jacobian) {
      swap(before_, c);
      if (approximations_.exact_bias()) take_biases(before_, c);
    } else if (approximations_.bias_update) {
      take_biases(before_, c);
    }
    if (approximations_.current_jacobian_bias) {
      take_biases(first_, c);
      update_biases(problem, sum);
    }
  }

  static void take_biases(const Kept& from, Constraints& c) {
    for (std::size_t i = 0; i < c.rows.size(); ++i) c.rows[i].beta = from.rows[i].beta;
    for (std::size_t i = 0; i < from.normals.size(); ++i) {
      c.contacts.normals[i].row.beta = from.normals[i].row.beta;
    }
    for (std::size_t i = 0; i < from.frictions.size(); ++i) {
      FrictionRows& rows = c.contacts.frictions[i];
      for (int k = 0; k < 2; ++k) {
        rows.row[k].beta = from.frictions[i].row[k].beta;
        rows.reference[k] = from.frictions[i].reference[k];
      }
    }
    for (std::size_t i = 0; i < from.patches.size(); ++i) {
      Patch& patch = c.contacts.patches[i];
      patch.normal_beta = from.patches[i].normal_beta;
      patch.beta = from.patches[i].beta;
      patch.reference = from.patches[i].reference;
    }
    // A displacement is that of the points that it was followed to.
    c.contacts.touching = from.touching;
  }

  Approximations approximations_;
  CoordinateVector stepped_;
  Kept first_;   ///< J̆¹, β¹
  Kept before_;  ///< of the sub-step that ends
};

}  // namespace

std::string_view name(Approximation approximation) {
  switch (approximation) {
    case Approximation::exact:
      return "none (A3)";
    case Approximation::bias_update:
      return "bias update";
    case Approximation::frozen_jacobian:
      return "frozen Jacobian";
    case Approximation::summed_rotation:
      return "summed rotation";
    case Approximation::current_jacobian_bias:
      return "current Jacobian in the bias";
    case Approximation::all_of_a4:
      break;
  }
  return "all of A4's";
}

Procedure ablation_procedure(Approximation approximation) {
  return Experiment(approximation);
}

std::string_view name(ContactAblation approximation) {
  switch (approximation) {
    case ContactAblation::none:
      return "none (A5)";
    case ContactAblation::limits_by_substep:
      return "limits by sub-step";
    case ContactAblation::file_order:
      break;
  }
  return "order of the file";
}

ContactReading contact_reading(ContactAblation approximation) {
  ContactReading reading;
  reading.limits_over_step = approximation != ContactAblation::limits_by_substep;
  reading.far_first = approximation != ContactAblation::file_order;
  return reading;
}

}  // namespace substep
