// The whole step's problem for the direct solver, and what its solution does to the velocities.

#include <algorithm>
#include <limits>

#include "sim/constraints/formulate.h"

namespace substep {
namespace {

/// Rows of J M^(−1/2) for the direct solver.
class MlcpWriter {
 public:
  MlcpWriter(const Problem& problem, const std::vector<Velocity>& v_local, Mlcp& mlcp)
      : model_(*problem.model), v_local_(v_local), mlcp_(mlcp) {}

  /// The row's bodies, J and β; limits are infinite.
  Mlcp::Row& add(int a, int b, const Vector3& linear, const Vector3& angular_a, const Vector3& angular_b,
                 double beta) {
    Mlcp::Row out{};
    out.a = moves(model_.masses[a]) ? a : -1;
    out.b = moves(model_.masses[b]) ? b : -1;
    set_part(a, 1, linear, angular_a, out.part_a);
    set_part(b, -1, linear, angular_b, out.part_b);
    out.right = beta - linear.dot(v_local_[a].linear - v_local_[b].linear) -
                angular_a.dot(v_local_[a].angular) - angular_b.dot(v_local_[b].angular);
    out.low = -std::numeric_limits<double>::infinity();
    out.high = -out.low;
    mlcp_.rows.push_back(out);
    return mlcp_.rows.back();
  }

  Mlcp::Row& add(const ContactBatch& x, int lane, const LaneVectors& direction, const ContactRow& row,
                 double beta) {
    const auto vector = [lane](const LaneVectors& v) { return Vector3(v[0][lane], v[1][lane], v[2][lane]); };
    return add(x.a[lane], x.b[lane], vector(direction), vector(row.angular_a), vector(row.angular_b), beta);
  }

 private:
  void set_part(int body, double sign, const Vector3& linear, const Vector3& angular, Vector6& part) const {
    const BodyMass& mass = model_.masses[body];
    part.head<3>() = linear * (sign * mass.root_inverse_mass);
    part.tail<3>() = angular.cwiseProduct(mass.root_inverse_inertia);
  }

  const Model& model_;
  const std::vector<Velocity>& v_local_;
  Mlcp& mlcp_;
};

/// The points of one manifold of a batch.
void add_manifold(const ContactBatches& contacts, const ContactBatch& x, int lane, MlcpWriter& writer,
                  Mlcp& mlcp) {
  const GivenBefore& before = contacts.given_before;
  const bool is_warm = before.normals.size() == contacts.normals.size();
  int friction = 0;
  for (int i = 0; i < x.count[lane]; ++i) {
    const ContactDirections& directions = contacts.directions[x.first_normal + i];
    const NormalRow& normal = contacts.normals[x.first_normal + i];
    const RestitutionRow* const bounce =
        x.first_restitution < 0 ? nullptr : &contacts.restitutions[x.first_restitution + i];
    const bool impact = bounce && bounce->impact[lane] > 0;
    Mlcp::Row& along = writer.add(x, lane, directions.normal, normal.row,
                                  impact ? bounce->right[lane] : normal.row.beta[lane]);
    along.low = 0;
    if (is_warm) along.start = std::max(0.0, -before.normals[x.first_normal + i][lane]);
    if (friction == x.frictions || x.contact_of[friction] != i) continue;
    const int row = static_cast<int>(mlcp.rows.size()) - 1;
    const int place = x.first_friction + friction++;
    const FrictionRows& rows = contacts.frictions[place];
    for (int k = 0; k < 2; ++k) {
      Mlcp::Row& out = writer.add(x, lane, directions.tangent[k], rows.row[k], 0);
      out.normal = row;
      out.friction = rows.coefficient[lane];
      if (is_warm) out.start = -before.frictions[place][k][lane];
    }
  }
}

}  // namespace

void make_mlcp(const Problem& problem, const std::vector<Velocity>& v_local, Mlcp& mlcp) {
  mlcp.bodies = static_cast<int>(problem.model->masses.size());
  mlcp.rows.clear();
  mlcp.rows.reserve(problem.c.row_count());
  MlcpWriter writer(problem, v_local, mlcp);
  for (const Block& x : problem.c.blocks) {
    const Row& row = problem.c.rows[x.first];
    Mlcp::Row& out = writer.add(x.a, x.b, row.linear, row.angular_a, row.angular_b, row.beta);
    out.low = row.low;
    out.high = row.high;
    out.softness = row.softness;
    if (!problem.c.given_before.empty()) out.start = problem.c.given_before[x.first];
  }
  for (const ContactBatch& x : problem.c.contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      add_manifold(problem.c.contacts, x, lane, writer, mlcp);
    }
  }
}

void keep_impulses(const std::vector<double>& lambda, Constraints& c) {
  std::size_t next = 0;  // as make_mlcp() lists rows
  for (const Block& x : c.blocks) c.rows[x.first].impulse = lambda[next++];
  ContactBatches& contacts = c.contacts;
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      int friction = 0;
      for (int i = 0; i < x.count[lane]; ++i) {
        contacts.normals[x.first_normal + i].row.impulse[lane] = lambda[next++];
        contacts.given_before.normals[x.first_normal + i][lane] = 0;
        if (friction == x.frictions || x.contact_of[friction] != i) continue;
        const int place = x.first_friction + friction++;
        for (int k = 0; k < 2; ++k) {
          contacts.frictions[place].row[k].impulse[lane] = lambda[next++];
          contacts.given_before.frictions[place][k][lane] = 0;
        }
      }
    }
  }
}

void add_impulses(const Model& model, const std::vector<Vector6>& impulses, std::vector<Velocity>& v_local) {
  for (std::size_t i = 0; i < v_local.size(); ++i) {
    v_local[i].linear += model.masses[i].root_inverse_mass * impulses[i].head<3>();
    v_local[i].angular += model.masses[i].root_inverse_inertia.cwiseProduct(impulses[i].tail<3>());
  }
}

}  // namespace substep
