// Solved manifolds and patches obey their laws at each point and corner.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/constraints/contact_batch.h"
#include "sim/constraints/contact_finder.h"
#include "sim/constraints/contact_patch.h"
#include "sim/constraints/formulate.h"
#include "sim/measure/claims_measurement.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

/// A row of the first lane.
struct LaneRow {
  LaneRow(const ContactBatch& batch, const LaneVectors& along, const ContactRow& row)
      : x(batch),
        direction(along.lane(0)),
        angular_a(row.angular_a.lane(0)),
        angular_b(row.angular_b.lane(0)),
        beta(row.beta[0]),
        impulse(row.impulse[0]) {}

  /// Returns J v − β.
  double missed(const std::vector<Velocity>& v) const {
    const Velocity& a = v[x.a[0]];
    const Velocity& b = v[x.b[0]];
    return direction.dot(a.linear - b.linear) + angular_a.dot(a.angular) + angular_b.dot(b.angular) - beta;
  }

  /// Applies v ← v − M⁻¹Jᵀλ.
  void take_back(std::vector<Velocity>& v) const {
    Velocity& a = v[x.a[0]];
    Velocity& b = v[x.b[0]];
    a.linear -= direction * (impulse * x.inverse_mass_a[0]);
    b.linear += direction * (impulse * x.inverse_mass_b[0]);
    a.angular -= x.inverse_inertia_a.lane(0).cwiseProduct(angular_a) * impulse;
    b.angular -= x.inverse_inertia_b.lane(0).cwiseProduct(angular_b) * impulse;
  }

  const ContactBatch& x;
  Vector3 direction;
  Vector3 angular_a;
  Vector3 angular_b;
  double beta;
  double impulse;
};

/// Violations of a solved manifold's law: velocities in m/s, impulses relative to the largest.
struct Violation {
  double approach = 0;       ///< approaching velocity along a normal, m/s
  double pull = 0;           ///< negative normal impulse
  double complementary = 0;  ///< normal impulse at a leaving point: min(λ/λ_max, m/s)
  double disc = 0;           ///< friction beyond its disc
  double slip = 0;           ///< slip within the disc, m/s
  double direction = 0;      ///< slip that is not against the friction on the disc's edge, m/s
  double applied = 0;        ///< v − v₀ − M⁻¹Jᵀλ
  int lifting = 0;           ///< points
  int holding = 0;
  int sliding = 0;
};

/// A box that hits a moving plate or the world, and the rows of its contacts.
struct BoxOnPlate {
  BoxOnPlate(unsigned seed, bool on_world, const Vector3& size, double mass, double disturbance)
      : friction(0.2 + 0.05 * (seed % 13)),
        scene(make_scene(seed, on_world, size, mass, disturbance)),
        model(build_model(scene)),
        finder(scene, model),
        state(initial_state(scene)),
        found(finder.find(state, h, 1)),
        v(state.v) {
    problem.model = &model;
    problem.contacts = &found;
    problem.substeps.duration = h;
    problem.substeps.offset.resize(state.v.size());
  }

  /// Formulates the rows: of patches at `q`, or of points where `q` is empty.
  void formulate_rows(const std::vector<Coordinates>& q) {
    build_blocks(problem, Joints::rows);
    build_contacts(problem, q);
    formulate(problem, state.q, h);
    to_local(problem.rotations, v);
    start_substep(problem, v);
  }

  static constexpr double h = 1.0 / 90;
  double friction;
  Scene scene;
  Model model;
  ContactFinder finder;
  State state;
  std::vector<Contact> found;
  Problem problem;
  std::vector<Velocity> v;  ///< local

 private:
  Scene make_scene(unsigned seed, bool on_world, const Vector3& size, double mass, double disturbance) const {
    Scene made = test::empty_scene();
    const Quaternion slope = rotation_quaternion({0.3, 0.2, -0.25});
    if (on_world) {
      Collider& floor = made.colliders.emplace_back();
      floor.shape = Plane{};
      floor.placement.orientation = slope;
      floor.material.dynamic_friction = floor.material.static_friction = friction;
    } else {
      test::add_box(made, {1.1, 0.2, 0.9}, 0.3 + seed % 5, {slope * Vector3(0.1, -0.1, 0.07), slope},
                    friction);
    }
    test::add_box(
        made, size, mass,
        {slope * Vector3(0.02, 0.175, -0.03), slope * rotation_quaternion({0, 0.1 * (seed % 7), 0})},
        friction);
    const Pose pose = made.bodies.back().pose;
    made = claims::disturbed(made, seed, disturbance);
    made.bodies.back().pose = pose;
    if (!on_world) made.bodies[1].pose.orientation = slope;
    return made;
  }
};

void solve_one(unsigned seed, int sweeps, Violation& worst) {
  BoxOnPlate box(seed, seed % 2 == 0, {0.5, 0.35, 0.4}, 0.7 + 3 * (seed % 3), 1.5);
  box.formulate_rows({});
  ContactBatches& contacts = box.problem.c.contacts;
  ASSERT_EQ(contacts.batches.size(), 1U) << seed;
  const ContactBatch& x = contacts.batches[0];
  ASSERT_EQ(x.contacts, 4) << seed;
  const double friction = box.friction;
  std::vector<Velocity>& v = box.v;
  add_external(box.problem, BoxOnPlate::h, v);
  const std::vector<Velocity> v_start = v;
  for (int sweep = 0; sweep < sweeps; ++sweep) solve_and_apply(contacts, x, {}, v);

  double largest = 0;
  for (const NormalRow& normal : contacts.normals) largest = std::max(largest, normal.row.impulse[0]);
  if (largest == 0) return;  // the bodies separate
  std::vector<Velocity> rest = v;
  const ContactDirections& directions = contacts.directions[x.first_point];
  for (int i = 0; i < x.contacts; ++i) {
    const LaneRow row(x, directions.normal, contacts.normals[i].row);
    const double missed = row.missed(v);
    worst.approach = std::max(worst.approach, -missed);
    worst.pull = std::max(worst.pull, -row.impulse / largest);
    worst.complementary = std::max(worst.complementary, std::min(row.impulse / largest, missed));
    if (row.impulse == 0) ++worst.lifting;
    row.take_back(rest);
  }
  for (int i = 0; i < x.contacts; ++i) {
    const FrictionRows& rows = contacts.frictions[i];
    const LaneRow first(x, directions.tangent[0], rows.row[0]);
    const LaneRow second(x, directions.tangent[1], rows.row[1]);
    const double limit = friction * contacts.normals[i].row.impulse[0];
    const double impulse = std::hypot(first.impulse, second.impulse);
    const double slip_1 = first.missed(v);
    const double slip_2 = second.missed(v);
    const double slip = std::hypot(slip_1, slip_2);
    worst.disc = std::max(worst.disc, (impulse - limit) / largest);
    if (impulse < limit - 1e-6 * largest) {
      worst.slip = std::max(worst.slip, slip);
      ++worst.holding;
    } else if (impulse > 1e-6 * largest) {
      // Against the impulse: slip |λ| = −slip · λ.
      const double along = -(slip_1 * first.impulse + slip_2 * second.impulse) / impulse;
      const double aside =
          std::hypot(slip_1 + along * first.impulse / impulse, slip_2 + along * second.impulse / impulse);
      worst.direction = std::max({worst.direction, aside, -along});
      if (slip > 1e-3) ++worst.sliding;
    }
    first.take_back(rest);
    second.take_back(rest);
  }
  for (std::size_t body = 0; body < v.size(); ++body) {
    worst.applied = std::max(worst.applied, (rest[body].linear - v_start[body].linear).norm());
    worst.applied = std::max(worst.applied, (rest[body].angular - v_start[body].angular).norm());
  }
}

/// Returns the worst violations of 400 boxes, on the world and on another body, that stick, slide and tip.
Violation violation_after(int sweeps) {
  Violation worst;
  for (unsigned seed = 1; seed <= 400; ++seed) solve_one(seed, sweeps, worst);
  // The sample has points of each kind.
  EXPECT_GT(worst.lifting, 190);  // measured 200
  EXPECT_GT(worst.holding, 40);
  EXPECT_GT(worst.sliding, 700);
  EXPECT_EQ(worst.pull, 0);
  EXPECT_LT(worst.disc, 1e-15);     // measured 1.7e-16
  EXPECT_LT(worst.slip, 1e-12);     // measured 1.7e-14 m/s
  EXPECT_LT(worst.applied, 1e-11);  // measured 5e-13 m/s
  return worst;
}

TEST(ContactBatches, ConvergedManifoldObeysItsLaws) {
  const Violation some = violation_after(200);
  EXPECT_LT(some.approach, 1e-6);       // measured 5.9e-7 m/s
  EXPECT_LT(some.complementary, 1e-6);  // measured 5.9e-7
  EXPECT_LT(some.direction, 1e-4);      // measured 6.8e-5 m/s, in one of the 400
  const Violation more = violation_after(1000);
  EXPECT_LT(more.approach, 1e-10);       // measured 2.4e-11
  EXPECT_LT(more.complementary, 1e-10);  // measured 2.4e-11
  EXPECT_LT(more.direction, 1e-8);       // measured 4.8e-9
}

/// Violations of a solved patch's law.
struct PatchViolation {
  double approach = 0;       ///< approaching velocity of a corner, m/s
  double pull = 0;           ///< the centre of pressure outside of the hull, of the radius
  double complementary = 0;  ///< |λ · (J v − β)| of the normals over their force's λ, m/s
  double friction = 0;       ///< force along the tangents beyond μ N, of μ N
  double slip = 0;           ///< slip of sticking patches, m/s
  double direction = 0;      ///< sliding: distance from friction that opposes the slip, relative to μ N
  int lifting = 0;           ///< patches that tip about a side or corner
  int sliding = 0;
  int cycling = 0;  ///< patches that stick and slide in turns
};

/// Returns the friction that opposes the slip of each corner, by μ N: along the tangents, and the twist. The
/// four corners' pressure varies linearly and has the centre `pressure`.
Vector3 opposing_friction(const PatchShape& shape, const Vector3& pressure, const Vector3& slip_and_twist) {
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (int i = 0; i < shape.corners; ++i) {
    const Eigen::Map<const Eigen::Vector2d> corner(shape.corner[i]);
    moments += corner * corner.transpose();
  }
  const Eigen::Vector2d slope = moments.inverse() * pressure.tail<2>();
  Vector3 friction = Vector3::Zero();
  double sum = 0;
  for (int i = 0; i < shape.corners; ++i) {
    const Eigen::Map<const Eigen::Vector2d> corner(shape.corner[i]);
    const double share = std::max(0.0, 1.0 / shape.corners + slope.dot(corner));
    const Eigen::Vector2d slip(slip_and_twist[0] - slip_and_twist[2] * corner.y(),
                               slip_and_twist[1] + slip_and_twist[2] * corner.x());
    const Eigen::Vector2d force = -share * slip.normalized();
    friction += Vector3(force.x(), force.y(), corner.x() * force.y() - corner.y() * force.x());
    sum += share;
  }
  return friction / sum;
}

/// Solves a box on a moving plate as a patch, and measures the violations at its corners: their velocities,
/// and whether the centre of pressure lies between them.
void solve_patch_of(unsigned seed, PatchViolation& worst) {
  BoxOnPlate box(seed, false, {0.4, 0.35, 0.5}, 1.2, 0.5);
  if (box.found.size() != 4) return;  // they leave each other
  for (Contact& contact : box.found) {
    contact.restitution = Contact::no_impact;
    contact.slid = true;
  }
  box.formulate_rows(box.state.q);
  const Problem& problem = box.problem;
  ContactBatches& contacts = box.problem.c.contacts;
  ASSERT_EQ(contacts.batches.size(), 1U) << seed;
  const ContactBatch& x = contacts.batches[0];
  ASSERT_EQ(x.patch, 0) << seed;
  const State& state = box.state;
  std::vector<Velocity>& v = box.v;
  for (int sweep = 0; sweep < 2000; ++sweep) solve_and_apply(contacts, x, {}, v);

  const Patch& patch = contacts.patches[0];
  const PatchShape& shape = contacts.shapes[0];
  const Vector3 normals = patch.normal_impulse.lane(0);
  const Vector3 force = patch.impulse.lane(0);
  if (!(normals[0] > 0)) return;
  // Velocities of points of a relative to b, in the world.
  const Velocity& va = v[x.a[0]];
  const Velocity& vb = v[x.b[0]];
  const Vector3 normal = problem.rotations[x.b[0]] * shape.axes_in_b.col(0);
  bool lifts = false;
  for (const Contact& contact : box.found) {
    const Vector3 velocity = va.linear - vb.linear +
                             problem.rotations[x.a[0]] * va.angular.cross(contact.arm_a) -
                             problem.rotations[x.b[0]] * vb.angular.cross(contact.arm_b);
    const double gap = normal.dot(state.q[x.a[0]].linear + problem.rotations[x.a[0]] * contact.arm_a -
                                  state.q[x.b[0]].linear - problem.rotations[x.b[0]] * contact.arm_b) +
                       contact.left_over;
    const double opening = normal.dot(velocity) + gap / BoxOnPlate::h;
    worst.approach = std::max(worst.approach, -opening);
    lifts = lifts || opening > 1e-3;
  }
  worst.lifting += lifts;
  // Complementarity: λ · (J v − β) = 0.
  BodyVelocities a;
  BodyVelocities b;
  for (int k = 0; k < 3; ++k) {
    a.linear[k] = Lanes{va.linear[k]};
    a.angular[k] = Lanes{va.angular[k]};
    b.linear[k] = Lanes{vb.linear[k]};
    b.angular[k] = Lanes{vb.angular[k]};
  }
  const RelativeMotion motion = relative_motion(patch, a, b);
  const double power = normals.dot(of_normals(motion).lane(0) - patch.normal_beta.lane(0)) / normals[0];
  worst.complementary = std::max(worst.complementary, std::abs(power));
  const Vector3 pressure(0, -normals[2] / normals[0], normals[1] / normals[0]);
  for (int i = 0; i < shape.corners; ++i) {
    const double* const here = shape.corner[i];
    const double* const next = shape.corner[(i + 1) % shape.corners];
    const double inside =
        (next[0] - here[0]) * (pressure[2] - here[1]) - (next[1] - here[1]) * (pressure[1] - here[0]);
    worst.pull = std::max(worst.pull, -inside / (shape.radius * shape.radius));
  }
  const double limit = shape.friction * normals[0];
  worst.friction = std::max(worst.friction, std::hypot(force[0], force[1]) / limit - 1);
  const Vector3 slip_and_twist = of_friction(motion).lane(0) - patch.beta.lane(0);
  if (patch.slides[0] == 0) {
    worst.slip = std::max(worst.slip, slip_and_twist.norm());
  } else if (slip_and_twist.norm() > 1e-3) {
    ++worst.sliding;
    const Vector3 opposing = opposing_friction(shape, pressure, slip_and_twist);
    const double off = (force / limit - opposing).norm();
    constexpr double cycles = 1e-3;
    if (off < cycles) worst.direction = std::max(worst.direction, off);
    worst.cycling += off >= cycles;
  }
}

TEST(ContactPatches, ConvergeToTheirLaws) {
  PatchViolation worst;
  for (unsigned seed = 1; seed <= 400; ++seed) solve_patch_of(seed, worst);
  EXPECT_GT(worst.lifting, 20);          // measured 91
  EXPECT_GT(worst.sliding, 20);          // measured 216
  EXPECT_LE(worst.cycling, 1);           // measured 1
  EXPECT_LT(worst.approach, 1e-9);       // measured 1.2e-10 m/s
  EXPECT_LT(worst.complementary, 1e-9);  // measured 7e-11
  EXPECT_LT(worst.pull, 1e-13);          // measured 4e-15
  EXPECT_LT(worst.friction, 1e-13);      // measured 0
  EXPECT_LT(worst.slip, 1e-13);          // measured 7e-17 m/s
  EXPECT_LT(worst.direction, 1e-4);      // measured 2.7e-5, in one; 6e-10 in all others
}

TEST(ContactPatches, TakeTheWrenchOfTheirPoints) {
  const Quaternion turned = rotation_quaternion({0.4, -0.7, 0.2});
  const Matrix3 axes = turned.toRotationMatrix();
  std::vector<Contact> contacts(4, Contact{});
  Vector3 force = Vector3::Zero();
  for (int i = 0; i < 4; ++i) {
    Contact& contact = contacts[i];
    contact.friction = 0.5;
    contact.normal_b = axes.col(0);
    contact.tangent_b1 = axes.col(1);
    contact.tangent_b2 = axes.col(2);
    contact.arm_a = contact.arm_b = axes * Vector3(0.1, i % 2 == 0 ? 0.3 : -0.2, i < 2 ? 0.4 : -0.1);
    contact.force = {2.0 + i, 0.3 * i - 0.5, 0.7 - 0.2 * i};
    force += contact.force;
  }
  const auto shape = patch_shape(contacts.data(), 4, {}, {});
  ASSERT_TRUE(shape);
  Vector3 torque = Vector3::Zero();
  for (const Contact& contact : contacts)
    torque += axes.transpose() * (contact.arm_b - shape->arm_b).cross(axes * contact.force);
  const double expected[6] = {force[0], torque[1], torque[2], force[1], force[2], torque[0]};
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(shape->force[k], expected[k], 1e-14) << k;
}

}  // namespace
}  // namespace substep
