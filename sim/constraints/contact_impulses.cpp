// Impulses of contacts, read from the rows that were solved.

#include "sim/constraints/formulate.h"

namespace substep {
namespace {

/// Returns a patch's impulse, at the centre of its pressure.
ContactImpulse impulse_of_patch(const ContactBatches& contacts, const ContactBatch& x, int lane,
                                const std::vector<Coordinates>& q) {
  const Patch& patch = contacts.patches[x.patch];
  const double normal = patch.normal_impulse[0][lane];
  const double force[3] = {normal, patch.impulse[0][lane], patch.impulse[1][lane]};
  // Move the point from the patch's centre to where the normals' wrench has no torque.
  double along[3] = {patch.arm_a[0][lane], patch.arm_a[1][lane], patch.arm_a[2][lane]};
  if (normal > 0) {
    along[1] -= patch.normal_impulse[2][lane] / normal;
    along[2] += patch.normal_impulse[1][lane] / normal;
  }
  Vector3 impulse = Vector3::Zero();
  Vector3 arm = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    const LaneVectors& axis = patch.in_world[k];
    const LaneVectors& axis_in_a = patch.in_a[k];
    impulse += force[k] * Vector3(axis[0][lane], axis[1][lane], axis[2][lane]);
    arm += along[k] * Vector3(axis_in_a[0][lane], axis_in_a[1][lane], axis_in_a[2][lane]);
  }
  const Coordinates& at = q[x.a[lane]];
  return {x.a[lane], x.b[lane], at.angular * arm + at.linear, impulse};
}

}  // namespace

void append_contact_impulses(const Problem& problem, const std::vector<Coordinates>& q,
                             std::vector<ContactImpulse>& result) {
  const ContactBatches& contacts = problem.c.contacts;
  const auto impulse_of = [](const ContactRow& row, const LaneVectors& direction, int lane) -> Vector3 {
    return row.impulse[lane] * Vector3(direction[0][lane], direction[1][lane], direction[2][lane]);
  };
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      if (x.patch >= 0) {
        result.push_back(impulse_of_patch(contacts, x, lane, q));
        continue;
      }
      int friction = 0;
      for (int i = 0; i < x.count[lane]; ++i) {
        const Contact& found = (*problem.contacts)[x.source[lane] + i];
        const ContactDirections& directions = contacts.directions[x.first_normal + i];
        Vector3 impulse = impulse_of(contacts.normals[x.first_normal + i].row, directions.normal, lane);
        if (friction < x.frictions && x.contact_of[friction] == i) {
          const FrictionRows& rows = contacts.frictions[x.first_friction + friction++];
          for (int k = 0; k < 2; ++k) impulse += impulse_of(rows.row[k], directions.tangent[k], lane);
        }
        const Coordinates& at = q[found.a];
        result.push_back({x.a[lane], x.b[lane], at.angular * found.arm_a + at.linear, impulse});
      }
    }
  }
}

}  // namespace substep
