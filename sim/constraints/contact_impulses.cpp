// What contacts gave, read from the rows that were solved.

#include "sim/constraints/formulate.h"

namespace substep {
namespace {

Vector3 direction(const ContactRow& row, int lane) {
  return {row.linear[0][lane], row.linear[1][lane], row.linear[2][lane]};
}

}  // namespace

std::vector<ContactImpulse> contact_impulses(const Problem& problem, const std::vector<Coordinates>& q,
                                             const std::vector<double>* lambda) {
  const ContactBatches& contacts = problem.c.contacts;
  std::vector<ContactImpulse> result;
  std::size_t next = problem.c.blocks.size();  // as make_mlcp() lists rows
  const auto impulse_of = [&](const ContactRow& row, int lane) -> Vector3 {
    const double size = lambda ? (*lambda)[next++] : row.impulse[lane];
    return size * direction(row, lane);
  };
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      int next_friction = x.first_friction;
      const int end_friction = x.first_friction + x.frictions;
      for (int i = 0; i < x.contacts; ++i) {
        const Contact& found = (*problem.contacts)[x.source[lane] + i];
        Vector3 impulse = impulse_of(contacts.normals[x.first_normal + i].row, lane);
        if (next_friction < end_friction && contacts.frictions[next_friction].normal == i) {
          for (const ContactRow& tangent : contacts.frictions[next_friction++].row) {
            impulse += impulse_of(tangent, lane);
          }
        }
        const Coordinates& at = q[found.a];
        result.push_back({x.a[lane], x.b[lane], at.angular * found.arm_a + at.linear, impulse});
      }
    }
  }
  return result;
}

}  // namespace substep
