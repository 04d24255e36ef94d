// Writes a step's rows as a problem for the direct solver, and stores the impulses of its solution.

#include <algorithm>

#include "sim/constraints/formulate.h"

namespace substep {
namespace {

/// Writes rows of J M^(−1/2) to the direct solver's problem.
class MlcpWriter {
 public:
  MlcpWriter(const Problem& problem, const std::vector<Velocity>& v_local, Mlcp& mlcp)
      : model_(*problem.model), v_local_(v_local), mlcp_(mlcp) {}

  /// Adds a row with its bodies, J and β. Its limits are infinite.
  Mlcp::Row& add(int a, int b, const Jacobian& j, double beta) {
    Mlcp::Row out{};
    out.a = moves(model_.masses[a]) ? a : -1;
    out.b = moves(model_.masses[b]) ? b : -1;
    set_part(a, 1, j.linear, j.angular_a, out.part_a);
    set_part(b, -1, j.linear, j.angular_b, out.part_b);
    out.right = beta - j.linear.dot(v_local_[a].linear - v_local_[b].linear) -
                j.angular_a.dot(v_local_[a].angular) - j.angular_b.dot(v_local_[b].angular);
    out.low = -infinity;
    out.high = -out.low;
    mlcp_.rows.push_back(out);
    return mlcp_.rows.back();
  }

  /// Adds the rows of a lane's manifold, point by point: the normal, then its friction.
  void add_manifold(const ContactBatches& contacts, const ContactBatch& x, int lane) {
    // A1's guess of λ: StartImpulses are minus the last step's impulses, as the sums start from 0.
    const StartImpulses& before = contacts.start_impulses;
    const bool is_warm = before.points.size() == contacts.normals.size();
    int normal = 0;
    for_each_row(contacts, x, x.count[lane],
                 [&](int i, int k, const LaneVectors& direction, const ContactRow& row) {
                   const int point = x.first_point + i;
                   const bool has_impact = x.has_impacts && contacts.restitutions[point].impact[lane] > 0;
                   const double beta = k > 0        ? 0
                                       : has_impact ? contacts.restitutions[point].right[0][lane]
                                                    : row.beta[lane];
                   const int index = static_cast<int>(mlcp_.rows.size());
                   const Jacobian j{direction.lane(lane), row.angular_a.lane(lane), row.angular_b.lane(lane)};
                   Mlcp::Row& out = add(x.a[lane], x.b[lane], j, beta);
                   const double start = is_warm ? -before.points[point][k][lane] : 0;
                   if (k == 0) {
                     normal = index;
                     out.low = 0;
                     out.start = std::max(0.0, start);
                   } else {
                     out.normal = normal;
                     out.friction = contacts.frictions[point].coefficient[lane];
                     out.start = start;
                   }
                 });
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

}  // namespace

void make_mlcp(const Problem& problem, const std::vector<Velocity>& v_local, Mlcp& mlcp) {
  mlcp.bodies = static_cast<int>(problem.model->masses.size());
  mlcp.rows.clear();
  mlcp.rows.reserve(problem.c.row_count());
  MlcpWriter writer(problem, v_local, mlcp);
  for (const Block& x : problem.c.blocks) {
    const Row& row = problem.c.rows[x.first];
    Mlcp::Row& out = writer.add(x.a, x.b, row, row.beta);
    out.low = row.low;
    out.high = row.high;
    out.softness = row.softness;
    if (!problem.c.last_step_impulses.empty()) out.start = problem.c.last_step_impulses[x.first];
  }
  for (const ContactBatch& x : problem.c.contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) writer.add_manifold(problem.c.contacts, x, lane);
  }
}

void keep_impulses(const std::vector<double>& lambda, Constraints& c) {
  std::size_t next = 0;  // index in the order of make_mlcp()
  for (const Block& x : c.blocks) c.rows[x.first].impulse = lambda[next++];
  ContactBatches& contacts = c.contacts;
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      for_each_row(contacts, x, x.count[lane], [&](int i, int k, const LaneVectors&, ContactRow& row) {
        row.impulse[lane] = lambda[next++];
        contacts.start_impulses.points[x.first_point + i][k][lane] = 0;
      });
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
