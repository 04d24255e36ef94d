// The contact cache from step to step, the impulses of warm starts, and those that a step reports.

#include <algorithm>
#include <tuple>

#include "sim/constraints/formulate.h"
#include "sim/math/sort_nearly_sorted.h"

namespace substep {
namespace {

/// Fraction of the displacement that remains where a point has only begun to slide at the step's end.
/// Measured on the wall, the pyramid of 210 and the card house for 3 s with ten sub-steps: with 0 they yield
/// by 11.6, 64 and 4.4 mm, with 0.5 by 6.7, 28 and 2.1 mm, with 1 by 6.4, 110 and 2.1 mm.
constexpr double kept_at_edge = 0.5;

/// The pose of a in b's frame at the step's end.
struct RelativePose {
  RelativePose(const Coordinates& a, const Coordinates& b) {
    const Matrix3 to_b = b.angular.toRotationMatrix().transpose();
    rotation = to_b * a.angular.toRotationMatrix();
    position = to_b * (a.linear - b.linear);
  }
  Matrix3 rotation;
  Vector3 position;
};

/// Returns the point's displacement at the step's end, in the body frame of b.
Vector3 displacement_at(const FrictionRows& rows, const PointArms& arms, int lane, const Contact& contact,
                        const RelativePose& a_in_b) {
  const Vector3 apart = a_in_b.position + a_in_b.rotation * arms.a.lane(lane) - arms.b.lane(lane);
  return contact.tangent_b1 * (rows.reference[0][lane] + contact.tangent_b1.dot(apart)) +
         contact.tangent_b2 * (rows.reference[1][lane] + contact.tangent_b2.dot(apart));
}

/// Sets the displacement that a patch keeps to the next step.
void remember_patch(const Patch& patch, int lane, bool keeps, const Coordinates& a, const Coordinates& b,
                    PatchShape& shape) {
  const bool at_edge = patch.slides[lane] > 0;
  shape.slid = at_edge && patch.slid[lane] > 0;
  shape.reference = patch.reference.lane(lane);
  if (keeps && !at_edge) return;
  const RelativePose a_in_b(a, b);
  const Vector3 slip = slip_of(shape, a_in_b.position, a_in_b.rotation);
  const double fraction = !keeps || shape.slid ? 0 : kept_at_edge;
  shape.reference = fraction * (slip + shape.reference) - slip;
}

/// Sets PatchShape::force from the patch's impulses in the last sub-step.
void set_force(const ContactBatches& contacts, const ContactBatch& x, int lane, PatchShape& shape) {
  const StartImpulses& before = contacts.start_impulses;
  const Patch& patch = contacts.patches[x.patch];
  for (int k = 0; k < 3; ++k) {
    shape.force[k] =
        before.force_of_impulse * (patch.normal_impulse[k][lane] - before.patches[x.patch][0][k][lane]);
    shape.force[3 + k] =
        before.force_of_impulse * (patch.impulse[k][lane] - before.patches[x.patch][1][k][lane]);
  }
}

/// Stores the forces of a manifold's points in the last sub-step, by the contacts' positions in the cache.
void remember_forces(const ContactBatches& contacts, const ContactBatch& x, int lane, const Contact* found,
                     const int* position_of, std::vector<ContactMemory>& memory) {
  const StartImpulses& before = contacts.start_impulses;
  for_each_row(
      contacts, x, x.count[lane], [&](int i, int k, const LaneVectors& /*direction*/, const ContactRow& row) {
        const Vector3* const along[3] = {&found[i].normal_b, &found[i].tangent_b1, &found[i].tangent_b2};
        const double given = row.impulse[lane] - before.points[x.first_point + i][k][lane];
        memory[position_of[i]].force += *along[k] * (before.force_of_impulse * given);
      });
}

/// Applies an impulse and torques, which are in the bodies' frames, to a lane's bodies.
void give(const ContactBatch& x, int lane, double scale, const Vector3& impulse, const Vector3& turn_a,
          const Vector3& turn_b, std::vector<Velocity>& v) {
  Velocity& a = v[x.a[lane]];
  Velocity& b = v[x.b[lane]];
  a.linear += impulse * (scale * x.inverse_mass_a[lane]);
  b.linear -= impulse * (scale * x.inverse_mass_b[lane]);
  a.angular += x.inverse_inertia_a.lane(lane).cwiseProduct(turn_a) * scale;
  b.angular += x.inverse_inertia_b.lane(lane).cwiseProduct(turn_b) * scale;
}

/// Returns the vector of a lane that has these components along a patch's axes.
Vector3 composed(const LaneVectors (&axes)[3], int lane, const Vector3& of) {
  return axes[0].lane(lane) * of[0] + axes[1].lane(lane) * of[1] + axes[2].lane(lane) * of[2];
}

/// Applies a patch's impulses to its bodies.
void give_patch(const ContactBatch& x, int lane, double scale, const Patch& patch, const Vector3& normals,
                const Vector3& friction, std::vector<Velocity>& v) {
  const Vector3 force(normals[0], friction[0], friction[1]);
  const Vector3 torque(friction[2], normals[1], normals[2]);
  const Vector3 turn_a = patch.arm_a.lane(lane).cross(force) + torque;
  const Vector3 turn_b = patch.arm_b.lane(lane).cross(force) + torque;
  give(x, lane, scale, composed(patch.in_world, lane, force), composed(patch.in_a, lane, turn_a),
       -composed(patch.in_b, lane, turn_b), v);
}

/// Starts a lane's patch warm.
void warm_start_patch(ContactBatches& contacts, const ContactBatch& x, int lane, double fraction,
                      double scale, std::vector<Velocity>& v) {
  Patch& patch = contacts.patches[x.patch];
  auto& before = contacts.start_impulses.patches[x.patch];
  LaneVectors* const impulses[2] = {&patch.normal_impulse, &patch.impulse};
  Vector3 start[2];
  for (int part = 0; part < 2; ++part) {
    for (int k = 0; k < 3; ++k)
      start[part][k] = fraction * ((*impulses[part])[k][lane] - before[part][k][lane]);
  }
  const double kept = start[0][0] > 0 ? 1 : 0;  // a patch that is pulled has no cone of friction
  for (int part = 0; part < 2; ++part) {
    for (int k = 0; k < 3; ++k) {
      before[part][k][lane] = (*impulses[part])[k][lane];
      (*impulses[part])[k][lane] += kept * start[part][k];
    }
  }
  give_patch(x, lane, scale, patch, kept * start[0], kept * start[1], v);
}

/// Returns a patch's impulse, at the centre of its pressure.
ContactImpulse impulse_of_patch(const ContactBatches& contacts, const ContactBatch& x, int lane,
                                const std::vector<Coordinates>& q) {
  const Patch& patch = contacts.patches[x.patch];
  const Vector3 normals = patch.normal_impulse.lane(lane);
  const Vector3 force(normals[0], patch.impulse[0][lane], patch.impulse[1][lane]);
  // Move the point from the patch's centre to where the normals' wrench has no torque.
  Vector3 arm = patch.arm_a.lane(lane);
  if (normals[0] > 0) {
    arm[1] -= normals[2] / normals[0];
    arm[2] += normals[1] / normals[0];
  }
  const Coordinates& at = q[x.a[lane]];
  return {x.a[lane], x.b[lane], at.angular * composed(patch.in_a, lane, arm) + at.linear,
          composed(patch.in_world, lane, force)};
}

}  // namespace

/// Sets the contacts' positions in the cache: by colliders, and the points of two colliders by where they are
/// on the first. The order is total, whatever the order of `found`. Where `found` ascends by the first of
/// each pair of colliders, sorting takes hardly more than counting.
void ContactBatches::sort_by_colliders(const std::vector<Contact>& found) {
  const auto precedes = [&](int one, int other) {
    const Contact& a = found[one];
    const Contact& b = found[other];
    return std::tie(a.collider_a, a.collider_b, a.arm_a[0], a.arm_a[1], a.arm_a[2], one) <
           std::tie(b.collider_a, b.collider_b, b.arm_a[0], b.arm_a[1], b.arm_a[2], other);
  };
  int colliders = 0;
  for (const Contact& contact : found) colliders = std::max(colliders, contact.collider_a + 1);
  begin_.assign(colliders + 1, 0);
  for (const Contact& contact : found) ++begin_[contact.collider_a + 1];
  for (int i = 1; i <= colliders; ++i) begin_[i] += begin_[i - 1];
  in_order_.resize(found.size());
  for (int i = 0; i < static_cast<int>(found.size()); ++i) in_order_[begin_[found[i].collider_a]++] = i;
  sort_nearly_sorted(in_order_, precedes);
  position_of_.resize(found.size());
  for (int i = 0; i < static_cast<int>(found.size()); ++i) position_of_[in_order_[i]] = i;
}

void ContactBatches::remember(const std::vector<Contact>& found, const std::vector<Coordinates>& q,
                              bool keeps, std::vector<ContactMemory>& memory,
                              std::vector<PatchShape>& patches_of_state) {
  sort_by_colliders(found);
  memory.resize(found.size());
  for (ContactMemory& point : memory) point.collider_a = -1;
  const bool is_warm = start_impulses.force_of_impulse > 0;
  for (const ContactBatch& x : batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      const Coordinates& a = q[x.a[lane]];
      const Coordinates& b = q[x.b[lane]];
      PatchShape* const shape = x.patch >= 0 ? &shapes[x.shape[lane]] : nullptr;
      if (shape) {
        remember_patch(patches[x.patch], lane, keeps, a, b, *shape);
        if (is_warm) set_force(*this, x, lane, *shape);
        if (shape->collider_a >= 0) continue;
      }
      const RelativePose a_in_b(a, b);
      const Vector3 slip = shape ? slip_of(*shape, a_in_b.position, a_in_b.rotation) : Vector3::Zero();
      for (int i = 0; i < x.count[lane]; ++i) {
        const Contact& contact = found[x.source[lane] + i];
        ContactMemory& point = memory[position_of_[x.source[lane] + i]];
        point = {contact.collider_a, contact.collider_b, contact.arm_a, contact.arm_b, Vector3::Zero(), true,
                 contact.left_over};
        if (shape) {
          point.slides = shape->slid;
          if (keeps) point.displacement = displacement_at(*shape, slip, contact.arm_b);
        } else if (x.has_friction) {
          const FrictionRows& rows = frictions[x.first_point + i];
          point.slides = rows.slides[lane] > 0 && rows.slid[lane] > 0;
          const double kept = !keeps || point.slides ? 0 : rows.slides[lane] > 0 ? kept_at_edge : 1;
          if (kept > 0)
            point.displacement =
                kept * displacement_at(rows, touching[x.first_point + i], lane, contact, a_in_b);
        }
      }
      if (!shape && is_warm)
        remember_forces(*this, x, lane, &found[x.source[lane]], &position_of_[x.source[lane]], memory);
    }
  }
  // Remove the points of patches, which the patches hold.
  std::erase_if(memory, [](const ContactMemory& point) { return point.collider_a < 0; });
  std::erase_if(shapes, [](const PatchShape& shape) { return shape.collider_a < 0; });
  patches_of_state.swap(shapes);
}

void set_start_impulses(ContactBatches& contacts, const std::vector<Contact>& found, double duration,
                        double scale) {
  StartImpulses& before = contacts.start_impulses;
  // Reserve the capacity of the rows: a step allocates nothing after the first.
  before.points.reserve(contacts.normals.capacity());
  before.patches.reserve(contacts.patches.capacity());
  before.points.resize(contacts.normals.size());
  before.patches.resize(contacts.patches.size());
  before.force_of_impulse = scale / duration;
  const double impulse = -duration / scale;  // of a force: the sums start from 0
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      for (int i = 0; i < x.count[lane] && x.patch < 0; ++i) {
        for (int k = 0; k < 3; ++k)
          before.points[x.first_point + i][k][lane] = impulse * found[x.source[lane] + i].force[k];
      }
      for (int k = 0; k < 6 && x.patch >= 0; ++k)
        before.patches[x.patch][k / 3][k % 3][lane] = impulse * contacts.shapes[x.shape[lane]].force[k];
    }
  }
}

void warm_start(ContactBatches& contacts, double fraction, double scale, std::vector<Velocity>& v) {
  StartImpulses& before = contacts.start_impulses;
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      if (x.patch >= 0) {
        warm_start_patch(contacts, x, lane, fraction, scale, v);
        continue;
      }
      double kept = 0;
      for_each_row(contacts, x, x.count[lane],
                   [&](int i, int k, const LaneVectors& direction, ContactRow& row) {
                     double& given = before.points[x.first_point + i][k][lane];
                     const double start = fraction * (row.impulse[lane] - given);
                     if (k == 0) kept = !x.has_impacts && start > 0 ? 1 : 0;
                     given = row.impulse[lane];
                     row.impulse[lane] += kept * start;
                     give(x, lane, scale * kept * start, direction.lane(lane), row.angular_a.lane(lane),
                          row.angular_b.lane(lane), v);
                   });
    }
  }
}

void append_contact_impulses(const Problem& problem, const std::vector<Coordinates>& q,
                             std::vector<ContactImpulse>& result) {
  const ContactBatches& contacts = problem.c.contacts;
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      if (x.patch >= 0) {
        result.push_back(impulse_of_patch(contacts, x, lane, q));
        continue;
      }
      const Coordinates& at = q[x.a[lane]];
      for_each_row(
          contacts, x, x.count[lane], [&](int i, int k, const LaneVectors& direction, const ContactRow& row) {
            const Vector3& arm = (*problem.contacts)[x.source[lane] + i].arm_a;
            if (k == 0)
              result.push_back({x.a[lane], x.b[lane], at.angular * arm + at.linear, Vector3::Zero()});
            result.back().impulse += row.impulse[lane] * direction.lane(lane);
          });
    }
  }
}

}  // namespace substep
