#include "sim/ladder.h"

#include <utility>

#include "sim/algorithms.h"
#include "sim/rotation.h"

namespace substep {
namespace {

/// A rung as switches over the listing of A3.
struct Approximations {
  explicit Approximations(Rung rung)
      : frozen_jacobian(rung == Rung::frozen_jacobian || rung == Rung::all_of_a4),
        bias_update(rung == Rung::bias_update || rung == Rung::all_of_a4),
        current_jacobian_bias(rung == Rung::current_jacobian_bias),
        summed_rotation(rung == Rung::summed_rotation || rung == Rung::all_of_a4),
        unstepped(rung == Rung::all_of_a4) {}

  bool exact_bias() const { return !bias_update && !current_jacobian_bias; }

  bool frozen_jacobian;
  bool bias_update;
  bool current_jacobian_bias;
  bool summed_rotation;
  bool unstepped;  ///< 'stable' blocks know the coordinates as the start and the sum, as in A4
};

class Experiment {
 public:
  explicit Experiment(Rung rung) : approximations_(rung) {}

  void operator()(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
                  Work& work) {
    const auto [n, m, tau, kappa] = settings.substepping();
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
      add_external(*problem.model, q, Frame::body, hs, v_local);
      for (int i = 1; i <= m; ++i) {
        for (Block& x : c.blocks) {
          update_stable(problem, x, v_local);
          apply(c, x, solve(c, x, kappa, tau, v_local), v_local);
        }
        for (const ContactBatch& x : c.contacts.batches)
          solve_and_apply(c.contacts, x, {.kappa = kappa, .tau = tau}, v_local);
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
  /// What a formulation overwrites.
  struct Kept {
    std::vector<Row> rows;
    std::vector<Matrix3> inverse_gammas;
    std::vector<NormalRow> normals;
    std::vector<FrictionRows> frictions;
    std::vector<Coupling> couplings;
  };

  static void keep(Kept& kept, const Constraints& c) {
    kept.rows = c.rows;
    kept.inverse_gammas = c.inverse_gammas;
    kept.normals = c.contacts.normals;
    kept.frictions = c.contacts.frictions;
    kept.couplings = c.contacts.couplings;
  }

  static void swap(Kept& kept, Constraints& c) {
    std::swap(kept.rows, c.rows);
    std::swap(kept.inverse_gammas, c.inverse_gammas);
    std::swap(kept.normals, c.contacts.normals);
    std::swap(kept.frictions, c.contacts.frictions);
    std::swap(kept.couplings, c.contacts.couplings);
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
  }

  Approximations approximations_;
  CoordinateVector stepped_;
  Kept first_;   ///< J̆¹, β¹
  Kept before_;  ///< of the sub-step that ends
};

}  // namespace

std::string_view name(Rung rung) {
  switch (rung) {
    case Rung::exact:
      return "none (A3)";
    case Rung::bias_update:
      return "bias update";
    case Rung::frozen_jacobian:
      return "frozen Jacobian";
    case Rung::summed_rotation:
      return "summed rotation";
    case Rung::current_jacobian_bias:
      return "current Jacobian in the bias";
    case Rung::all_of_a4:
      break;
  }
  return "all of A4's";
}

Procedure ladder_procedure(Rung rung) {
  return Experiment(rung);
}

std::string_view name(ContactRung rung) {
  switch (rung) {
    case ContactRung::all_six:
      return "all six (A5)";
    case ContactRung::velocity_level:
      return "τ, κ on velocity-level rows";
    case ContactRung::square_friction:
      return "friction in a square";
    case ContactRung::limits_by_substep:
      return "limits by sub-step";
    case ContactRung::file_order:
      return "order of the file";
    case ContactRung::single_normals:
      return "normals one by one";
    case ContactRung::forgetting_friction:
      break;
  }
  return "friction without memory";
}

bool is_beyond_report(ContactRung rung) {
  return rung == ContactRung::single_normals || rung == ContactRung::forgetting_friction;
}

ContactReading contact_reading(ContactRung rung) {
  ContactReading reading;
  reading.velocity_level_apart = rung != ContactRung::velocity_level;
  reading.isotropic_friction = rung != ContactRung::square_friction;
  reading.limits_over_step = rung != ContactRung::limits_by_substep;
  reading.far_first = rung != ContactRung::file_order;
  reading.manifold_blocks = rung != ContactRung::single_normals;
  reading.friction_memory = rung != ContactRung::forgetting_friction;
  return reading;
}

}  // namespace substep
