#include "sim/constraints/warm_start.h"

namespace substep {
namespace {

Vector3 lane_of(const LaneVectors& v, int lane) {
  return {v[0][lane], v[1][lane], v[2][lane]};
}

/// Calls `what` with each row of a manifold that is solved by points: its direction and how much the row had
/// given when the last sub-step began, by lane.
template <typename Function>
void for_each_row(ContactBatches& contacts, const ContactBatch& x, int lane, const Function& what) {
  int friction = 0;
  for (int i = 0; i < x.count[lane]; ++i) {
    const ContactDirections& along = contacts.directions[x.first_normal + i];
    what(i, 0, along.normal, contacts.normals[x.first_normal + i].row,
         contacts.given_before.normals[x.first_normal + i][lane]);
    if (friction == x.frictions || x.contact_of[friction] != i) continue;
    for (int k = 0; k < 2; ++k) {
      what(i, 1 + k, along.tangent[k], contacts.frictions[x.first_friction + friction].row[k],
           contacts.given_before.frictions[x.first_friction + friction][k][lane]);
    }
    ++friction;
  }
}

/// Gives a lane's bodies an impulse and torques, in the bodies' frames.
void give(const ContactBatch& x, int lane, double scale, const Vector3& impulse, const Vector3& turn_a,
          const Vector3& turn_b, std::vector<Velocity>& v) {
  Velocity& a = v[x.a[lane]];
  Velocity& b = v[x.b[lane]];
  a.linear += impulse * (scale * x.inverse_mass_a[lane]);
  b.linear -= impulse * (scale * x.inverse_mass_b[lane]);
  a.angular += lane_of(x.inverse_inertia_a, lane).cwiseProduct(turn_a) * scale;
  b.angular += lane_of(x.inverse_inertia_b, lane).cwiseProduct(turn_b) * scale;
}

/// Gives a patch's impulses to its bodies: normals and friction, as Patch has them.
void give_patch(const ContactBatch& x, int lane, double scale, const Patch& patch, const Vector3& normals,
                const Vector3& friction, std::vector<Velocity>& v) {
  const Vector3 force(normals[0], friction[0], friction[1]);
  const Vector3 torque(friction[2], normals[1], normals[2]);
  const auto composed = [&](const LaneVectors(&axes)[3], const Vector3& of) -> Vector3 {
    return lane_of(axes[0], lane) * of[0] + lane_of(axes[1], lane) * of[1] + lane_of(axes[2], lane) * of[2];
  };
  const Vector3 turn_a = lane_of(patch.arm_a, lane).cross(force) + torque;
  const Vector3 turn_b = lane_of(patch.arm_b, lane).cross(force) + torque;
  give(x, lane, scale, composed(patch.in_world, force), composed(patch.in_a, turn_a),
       -composed(patch.in_b, turn_b), v);
}

}  // namespace

void set_given_before(ContactBatches& contacts, const std::vector<Contact>& found, double duration,
                      double scale) {
  GivenBefore& before = contacts.given_before;
  // As many as there may be: a step allocates nothing after the first.
  before.normals.reserve(contacts.normals.capacity());
  before.frictions.reserve(contacts.frictions.capacity());
  before.patches.reserve(contacts.patches.capacity());
  before.normals.resize(contacts.normals.size());
  before.frictions.resize(contacts.frictions.size());
  before.patches.resize(contacts.patches.size());
  before.force_of_impulse = scale / duration;
  const double impulse = -duration / scale;  // of a force: the sums start from 0
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      if (x.patch >= 0) {
        for (int k = 0; k < 3; ++k) {
          const PatchShape& shape = contacts.shapes[x.shape[lane]];
          before.patches[x.patch][0][k][lane] = impulse * shape.force[k];
          before.patches[x.patch][1][k][lane] = impulse * shape.force[3 + k];
        }
        continue;
      }
      for_each_row(contacts, x, lane, [&](int i, int k, const LaneVectors&, ContactRow&, double& given) {
        given = impulse * found[x.source[lane] + i].force[k];
      });
    }
  }
}

void warm_start(ContactBatches& contacts, double fraction, double scale, std::vector<Velocity>& v) {
  GivenBefore& before = contacts.given_before;
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      if (x.patch >= 0) {
        Patch& patch = contacts.patches[x.patch];
        Vector3 start[2];
        for (int k = 0; k < 3; ++k) {
          start[0][k] = fraction * (patch.normal_impulse[k][lane] - before.patches[x.patch][0][k][lane]);
          start[1][k] = fraction * (patch.impulse[k][lane] - before.patches[x.patch][1][k][lane]);
        }
        const double kept = start[0][0] > 0 ? 1 : 0;  // what is pulled apart has no cone of friction
        for (int k = 0; k < 3; ++k) {
          before.patches[x.patch][0][k][lane] = patch.normal_impulse[k][lane];
          before.patches[x.patch][1][k][lane] = patch.impulse[k][lane];
          patch.normal_impulse[k][lane] += kept * start[0][k];
          patch.impulse[k][lane] += kept * start[1][k];
        }
        give_patch(x, lane, scale, patch, kept * start[0], kept * start[1], v);
        continue;
      }
      double kept = 0;
      for_each_row(contacts, x, lane,
                   [&](int, int k, const LaneVectors& direction, ContactRow& row, double& given) {
                     const double start = fraction * (row.impulse[lane] - given);
                     if (k == 0) kept = x.first_restitution < 0 && start > 0 ? 1 : 0;
                     given = row.impulse[lane];
                     row.impulse[lane] += kept * start;
                     give(x, lane, scale * kept * start, lane_of(direction, lane),
                          lane_of(row.angular_a, lane), lane_of(row.angular_b, lane), v);
                   });
    }
  }
}

Vector3 force_of_point(const ContactBatches& contacts, const ContactBatch& x, int lane, int i, int friction) {
  const GivenBefore& before = contacts.given_before;
  const int normal = x.first_normal + i;
  Vector3 force(contacts.normals[normal].row.impulse[lane] - before.normals[normal][lane], 0, 0);
  for (int k = 0; k < 2 && friction >= 0; ++k) {
    const int rows = x.first_friction + friction;
    force[1 + k] = contacts.frictions[rows].row[k].impulse[lane] - before.frictions[rows][k][lane];
  }
  return before.force_of_impulse * force;
}

void set_force(const ContactBatches& contacts, const ContactBatch& x, int lane, PatchShape& shape) {
  const GivenBefore& before = contacts.given_before;
  const Patch& patch = contacts.patches[x.patch];
  for (int k = 0; k < 3; ++k) {
    shape.force[k] =
        before.force_of_impulse * (patch.normal_impulse[k][lane] - before.patches[x.patch][0][k][lane]);
    shape.force[3 + k] =
        before.force_of_impulse * (patch.impulse[k][lane] - before.patches[x.patch][1][k][lane]);
  }
}

}  // namespace substep
