// Soft Step: sub-steps with soft constraints. Not from the report, but from Erin Catto, "Solver2D" (2024),
// with the parameters of Box2D 3 and Box3D. Written from the published description.
//
// | step                 | A3                        | here                                                   |
// |----------------------|---------------------------|--------------------------------------------------------|
// | warm start           | λ = 0 in each sub-step    | λ of the sub-step before, also of the last step        |
// | solve with bias      | J(κ v + M⁻¹Jᵀλ) = τ β     | the same with κ, τ from a frequency and a damping      |
// |                      |                           | ratio, less a fraction of the accumulated λ            |
// | relax                | –                         | a sweep without bias after the coordinates have moved  |
// | friction             | with its normal           | in the relaxing sweep alone                            |
// | restitution          | in the sub-step of impact | once, at the step's end                                |
//
// Defaults as published: four sub-steps; contacts of 30 Hz and ζ = 10, but with fixed bodies of 60 Hz and
// ζ = 5; joints of 60 Hz and ζ = 2. Overlaps are pushed out with 3 m/s at most, and impacts slower than 1 m/s
// do not bounce. Box3D has one friction block per manifold; here each point has its own.

#include "sim/descendants/descendants.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace substep {

Softness softness(double hertz, double damping_ratio, double hs) {
  const double omega = 2 * std::numbers::pi * hertz;
  const double stiffness = hs * omega * (2 * damping_ratio + hs * omega);
  return {omega / (2 * damping_ratio + hs * omega), stiffness / (1 + stiffness), 1 / (1 + stiffness)};
}

namespace {

constexpr double fastest_push = 3;    // m/s
constexpr double slowest_bounce = 1;  // m/s
constexpr Softness rigid{0, 1, 0};

/// Returns J v of one of a point's rows.
double velocity_along(const SoftPoint& x, int k, const std::vector<Velocity>& v) {
  return row_velocity(x.row[k], v[x.a], v[x.b]);
}

/// Applies an impulse of one row: v ← v + M⁻¹Jᵀ impulse.
void apply(const Model& model, const SoftPoint& x, int k, double impulse, std::vector<Velocity>& v) {
  const BodyMass& a = model.masses[x.a];
  const BodyMass& b = model.masses[x.b];
  const Jacobian& row = x.row[k];
  v[x.a].linear += row.linear * (a.inverse_mass * impulse);
  v[x.a].angular += a.inverse_inertia.cwiseProduct(row.angular_a) * impulse;
  v[x.b].linear -= row.linear * (b.inverse_mass * impulse);
  v[x.b].angular += b.inverse_inertia.cwiseProduct(row.angular_b) * impulse;
}

/// Returns Γ_kl of a point's rows.
double coupling(const Model& model, const SoftPoint& x, int k, int l) {
  const BodyMass& a = model.masses[x.a];
  const BodyMass& b = model.masses[x.b];
  const Jacobian& one = x.row[k];
  const Jacobian& other = x.row[l];
  return one.linear.dot(other.linear) * (a.inverse_mass + b.inverse_mass) +
         one.angular_a.dot(a.inverse_inertia.cwiseProduct(other.angular_a)) +
         one.angular_b.dot(b.inverse_inertia.cwiseProduct(other.angular_b));
}

/// Returns a point with its rows at the step's start, and with the last step's impulses.
SoftPoint point_of(const Contact& contact, const Problem& problem, const std::vector<Velocity>& v,
                   double hs) {
  const Model& model = *problem.model;
  SoftPoint x{};
  x.a = contact.a;
  x.b = contact.b;
  x.arm_a = contact.arm_a;
  x.arm_b = contact.arm_b;
  for (int k = 0; k < 3; ++k) x.row[k] = contact_jacobian(contact, problem, k);
  x.impulse = hs * contact.force;
  x.step_impulse = Vector3::Zero();
  x.gap_offset = contact.gap_offset;
  x.normal_mass = 1 / coupling(model, x, 0, 0);
  // Use the larger eigenvalue of the tangents' Γ: with one mass for both, friction opposes the slip.
  const double half = (coupling(model, x, 1, 1) - coupling(model, x, 2, 2)) / 2;
  const double both = coupling(model, x, 1, 2);
  x.friction_mass = 1 / (coupling(model, x, 2, 2) + half + std::sqrt(half * half + both * both));
  x.friction = contact.friction;
  x.restitution = contact.restitution;
  x.velocity = velocity_along(x, 0, v);
  return x;
}

/// Returns the distance of the bodies' points along the normal, m.
double gap_of(const SoftPoint& x, const Problem& problem) {
  const std::vector<Coordinates>& q = problem.substeps.stepped;
  const Vector3 apart =
      q[x.a].linear - q[x.b].linear + problem.rotations[x.a] * x.arm_a - problem.rotations[x.b] * x.arm_b;
  return x.row[0].linear.dot(apart) + x.gap_offset;
}

/// Adds λ' = −m (mass_scale J v + bias) − impulse_scale λ to a normal's λ, which stays >= 0. Returns λ'. m:
/// 1/Γ. `bias`, m/s: mass_scale bias_rate gap, at least −fastest_push; of separate bodies gap/hs.
double solve_normal(SoftPoint& x, double hs, const Softness& soft, const std::vector<Velocity>& v) {
  const double velocity = velocity_along(x, 0, v);
  // Separate bodies may meet in the sub-step; overlapping ones are pushed apart.
  const bool is_apart = x.gap > 0;
  const Softness& how = is_apart ? rigid : soft;
  const double bias = is_apart ? x.gap / hs : std::max(how.mass_scale * how.bias_rate * x.gap, -fastest_push);
  const double free =
      x.impulse[0] - x.normal_mass * (how.mass_scale * velocity + bias) - how.impulse_scale * x.impulse[0];
  const double change = std::max(free, 0.0) - x.impulse[0];
  x.impulse[0] += change;
  return change;
}

/// Adds λ' = −m J v to the tangents' λ, so that |λ| stays <= μ λ_n, and returns λ'.
Impulse solve_friction(SoftPoint& x, const std::vector<Velocity>& v) {
  const double total[2] = {x.impulse[1] - x.friction_mass * velocity_along(x, 1, v),
                           x.impulse[2] - x.friction_mass * velocity_along(x, 2, v)};
  const double limit = x.friction * x.impulse[0];
  const double size = std::sqrt(total[0] * total[0] + total[1] * total[1]);
  const double scale = size > limit ? limit / size : 1;
  const Impulse change{scale * total[0] - x.impulse[1], scale * total[1] - x.impulse[2]};
  x.impulse[1] += change[0];
  x.impulse[2] += change[1];
  return change;
}

/// Adds λ' to the impulses of a joint's block, and returns λ': soft, or rigid without bias in the relaxing
/// sweep. Motors, springs and dampers keep their own law.
Impulse solve_joint(Constraints& c, const Block& x, const Softness& soft, double hs,
                    const std::vector<Velocity>& v) {
  if (!x.stabilized) return solve(c, x, {}, v);
  const bool is_relaxing = soft.impulse_scale == 0;
  // β = −C/hs. A one-sided row that is off its bound may reach it in the sub-step.
  const bool is_off = x.rows == 1 && c.rows[x.first].low == 0 && c.rows[x.first].beta < 0;
  const Softness& how = is_off ? rigid : soft;
  const double tau = is_off ? 1 : is_relaxing ? 0 : how.tau(hs);
  Vector3 wanted = Vector3::Zero();
  for (int k = 0; k < x.rows; ++k) {
    const Row& row = c.rows[x.first + k];
    wanted[k] = tau * row.beta - how.mass_scale * row_velocity(row, v[x.a], v[x.b]);
  }
  const Vector3 lambda = x.rows == 1 ? Vector3(c.rows[x.first].effective_mass * wanted)
                                     : Vector3(c.effective_masses[x.coupling] * wanted);
  Impulse change{};
  for (int k = 0; k < x.rows; ++k) {
    Row& row = c.rows[x.first + k];
    const double free = row.impulse + lambda[k] - how.impulse_scale * row.impulse;
    change[k] = std::clamp(free, row.low, row.high) - row.impulse;
    row.impulse += change[k];
  }
  return change;
}

/// Makes the contacts' points at the step's start, with a frequency that the sub-steps can resolve.
void prepare_points(const Settings& settings, const Problem& problem, const std::vector<Velocity>& v,
                    double hs, std::vector<SoftPoint>& points) {
  const double hertz = std::min(settings.contact_hertz, 0.125 / hs);
  const Softness of_contacts = softness(hertz, soft_contact_damping, hs);
  const Softness of_static = softness(2 * hertz, soft_contact_damping / 2, hs);
  points.clear();
  points.reserve(problem.contacts->capacity());
  for (const Contact& contact : *problem.contacts) {
    points.push_back(point_of(contact, problem, v, hs));
    const bool is_static =
        !moves(problem.model->masses[contact.a]) || !moves(problem.model->masses[contact.b]);
    points.back().gap = gap_of(points.back(), problem);
    points.back().softness = is_static ? of_static : of_contacts;
  }
}

/// Applies restitution to points that met fast enough.
void apply_restitution(const Model& model, std::vector<SoftPoint>& points, std::vector<Velocity>& v) {
  for (SoftPoint& x : points) {
    if (!(x.restitution > 0) || x.velocity > -slowest_bounce || x.step_impulse[0] == 0) continue;
    const double velocity = velocity_along(x, 0, v);
    const double change = std::max(-x.normal_mass * (velocity + x.restitution * x.velocity), -x.impulse[0]);
    x.impulse[0] += change;
    x.step_impulse[0] += change;
    apply(model, x, 0, change, v);
  }
}

}  // namespace

std::int64_t soft_step(std::vector<Coordinates>& q, std::vector<Velocity>& v_local, const Settings& settings,
                       Problem& problem, std::vector<SoftPoint>& points, CarriedForces& carried) {
  const int n = settings.substeps;
  const double hs = settings.step / n;
  const Model& model = *problem.model;
  Constraints& c = problem.c;
  const Softness of_joints = softness(std::min(settings.joint_hertz, 0.25 / hs), soft_joint_damping, hs);
  c.limits_of = 1;  // impulses have the limits of one sub-step
  prepare_points(settings, problem, v_local, hs, points);
  for (int j = 1; j <= n; ++j) {
    // Integrate the velocities.
    add_external(problem, hs, v_local);
    // Warm start: apply the impulses of the sub-step before.
    for (const Block& x : c.blocks) apply(c, x, impulse_of(c, x), v_local);
    for (const SoftPoint& x : points) {
      for (int k = 0; k < 3; ++k) apply(model, x, k, x.impulse[k], v_local);
    }
    // Solve with bias.
    for (const Block& x : c.blocks) apply(c, x, solve_joint(c, x, of_joints, hs, v_local), v_local);
    for (SoftPoint& x : points) apply(model, x, 0, solve_normal(x, hs, x.softness, v_local), v_local);
    // Integrate the coordinates.
    renew_free_rotation(problem, hs, v_local);
    step_coordinates(hs, v_local, problem.substeps.stepped);
    formulate(problem, problem.substeps.stepped, hs);
    carry_momenta(problem, hs, v_local);
    // Relax: remove the velocity that the bias added, and let friction act.
    for (const Block& x : c.blocks) apply(c, x, solve_joint(c, x, rigid, hs, v_local), v_local);
    for (SoftPoint& x : points) {
      x.gap = gap_of(x, problem);
      apply(model, x, 0, solve_normal(x, hs, rigid, v_local), v_local);
      const Impulse friction = solve_friction(x, v_local);
      for (int k = 0; k < 2; ++k) apply(model, x, 1 + k, friction[k], v_local);
      x.step_impulse += x.impulse;
    }
  }
  apply_restitution(model, points, v_local);
  // Store the coordinates and forces. Divide by hs of an undivided step: in a short part of it the force of
  // an impact would be high, and a larger impulse in the next part.
  const double whole = hs / problem.substeps.part;
  q = problem.substeps.stepped;
  carried.contacts.clear();
  carried.contacts.reserve(problem.contacts->capacity());
  for (const SoftPoint& x : points) {
    carried.contacts.push_back({x.step_impulse, x.impulse / whole, Vector3::Zero(), Vector3::Zero()});
  }
  carried.joints.clear();
  for (const Row& row : c.rows) carried.joints.push_back(row.impulse / whole);
  return n * (2 * std::ssize(c.rows) + 4 * std::ssize(points));
}

}  // namespace substep
