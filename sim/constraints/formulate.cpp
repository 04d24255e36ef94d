#include "sim/constraints/formulate.h"

#include "sim/math/rotation.h"

namespace substep {
namespace {

/// What a block's rows are formulated from: its two bodies' coordinates, with rotations as matrices.
struct Placed {
  const Coordinates& a;
  const Coordinates& b;
  const Matrix3& rotation_a;
  const Matrix3& rotation_b;
};

/// Fills a row's angular parts from ᵣJ̆ᵀ, which are in the bodies' frames, and 1/Γ.
[[gnu::always_inline]] inline void set_angular(const Problem& problem, const Block& x, const Placed& at,
                                               const Vector3& local_a, const Vector3& local_b, Row& row) {
  const Vector3 response_a = problem.model->masses[x.a].inverse_inertia.cwiseProduct(local_a);
  const Vector3 response_b = problem.model->masses[x.b].inverse_inertia.cwiseProduct(local_b);
  const double gamma = row.linear.squaredNorm() * (x.inverse_mass_a + x.inverse_mass_b) +
                       local_a.dot(response_a) + local_b.dot(response_b);
  row.inverse_gamma = gamma > 0 ? 1 / gamma : 0;
  if (problem.frame == Frame::body) {
    row.angular_a = local_a;
    row.angular_b = local_b;
    row.response_a = response_a;
    row.response_b = response_b;
  } else {
    row.angular_a = at.rotation_a * local_a;  // ᵣJᵀ = R ᵣJ̆ᵀ (III.1)
    row.angular_b = at.rotation_b * local_b;
    row.response_a = at.rotation_a * response_a;
    row.response_b = at.rotation_b * response_b;
  }
}

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// The row's rigid and two-sided part; its kind says what else. Its impulse stays: a block may be formulated
/// amid its iteration.
void set_rigid(double beta, const Vector3& linear, Row& row) {
  row.linear = linear;
  row.beta = beta;
  row.low = -unlimited;
  row.high = unlimited;
  row.softness = 0;
}

/// Γ of the block's rows, inverted.
void invert_gamma(Constraints& c, const Block& x) {
  Matrix3 gamma = Matrix3::Identity();
  for (int i = 0; i < x.rows; ++i) {
    const Row& r = c.rows[x.first + i];
    for (int j = 0; j <= i; ++j) {
      const Row& s = c.rows[x.first + j];
      gamma(i, j) = gamma(j, i) = r.linear.dot(s.linear) * (x.inverse_mass_a + x.inverse_mass_b) +
                                  r.angular_a.dot(s.response_a) + r.angular_b.dot(s.response_b);
    }
  }
  c.inverse_gammas[x.coupling] = gamma.inverse();
}

/// The attachment frames in the world.
struct Frames {
  Vector3 arm_a;  ///< from a's centre of mass to its frame's origin
  Vector3 arm_b;
  Vector3 offset;  ///< from b's origin to a's
  Matrix3 axes_a;  ///< columns
  Matrix3 axes_b;
};

Frames frames_of(const Attachment& attachment, const Placed& at) {
  Frames f;
  f.arm_a = at.rotation_a * attachment.frame_a.position;
  f.arm_b = at.rotation_b * attachment.frame_b.position;
  f.offset = (at.a.linear + f.arm_a) - (at.b.linear + f.arm_b);
  f.axes_a = at.rotation_a * attachment.frame_a.orientation.toRotationMatrix();
  f.axes_b = at.rotation_b * attachment.frame_b.orientation.toRotationMatrix();
  return f;
}

/// A coordinate's value, and its rate as a row: linear, and ᵣJᵀ of both bodies in the world frame.
struct Measured {
  double value = 0;
  Vector3 linear = Vector3::Zero();
  Vector3 angular_a = Vector3::Zero();
  Vector3 angular_b = Vector3::Zero();
};

/// Along `direction` (unit), from b's origin to a's. The direction is fixed in b, whose turning adds
/// ω_b × direction · offset: as if b's arm reached to a's origin. Where it follows the offset that is zero.
Measured along(const Frames& f, const Vector3& direction) {
  return {direction.dot(f.offset), direction, f.arm_a.cross(direction), direction.cross(f.arm_b + f.offset)};
}

Measured about(double value, const Vector3& axis) {
  return {value, Vector3::Zero(), axis, -axis};
}

/// The rotation from b's frame to a's, in b's axes.
Quaternion relative_rotation(const Frames& f) {
  Quaternion q(Matrix3(f.axes_b.transpose() * f.axes_a));
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q;
}

Measured measure(const JointCoordinate& coordinate, const Frames& f) {
  using Kind = JointCoordinate::Kind;
  const Vector3 axis_b = f.axes_b.col(coordinate.axis);
  const Vector3 across_b = f.axes_b.col((coordinate.axis + 1) % 3);  // where a direction is not determined
  switch (coordinate.kind) {
    case Kind::position:
      return along(f, axis_b);
    case Kind::radius: {
      const Vector3 across = f.offset - axis_b * axis_b.dot(f.offset);
      const double radius = across.norm();
      return along(f, radius > 0 ? Vector3(across / radius) : across_b);
    }
    case Kind::distance: {
      const double distance = f.offset.norm();
      return along(f, distance > 0 ? Vector3(f.offset / distance) : across_b);
    }
    case Kind::twist: {
      // θ = 2 atan2(q_k, q_w), and its gradient by q' = ½ ω ∘ q, ω the relative velocity in b's axes.
      const Quaternion q = relative_rotation(f);
      const Vector3 v = q.vec();
      const double k = v[coordinate.axis];
      const Vector3 unit = Vector3::Unit(coordinate.axis);
      const double squared = q.w() * q.w() + k * k;
      if (squared == 0) return about(0, axis_b);
      const Vector3 axis = (q.w() * q.w() * unit + q.w() * v.cross(unit) + k * v) / squared;
      return about(2 * angle_of(k, q.w()), f.axes_b * axis);
    }
    case Kind::cone: {
      const Vector3 axis_a = f.axes_a.col(coordinate.axis);
      const Vector3 cross = axis_b.cross(axis_a);
      const double sine = cross.norm();
      return about(angle_of(sine, axis_a.dot(axis_b)), sine > 0 ? Vector3(cross / sine) : across_b);
    }
    case Kind::turn:
      break;
  }
  const Vector3 turn = rotation_vector(relative_rotation(f));
  const double angle = turn.norm();
  return about(angle, angle > 0 ? Vector3(f.axes_b * (turn / angle)) : across_b);
}

/// The row of ± a coordinate's rate.
void set_row(const Problem& problem, const Block& x, const Placed& at, const Measured& m, double sign,
             double beta, Row& row) {
  set_rigid(beta, sign * m.linear, row);
  set_angular(problem, x, at, at.rotation_a.transpose() * (sign * m.angular_a),
              at.rotation_b.transpose() * (sign * m.angular_b), row);
}

/// Adds softness to a row that has its Γ.
void soften(double softness, Row& row) {
  row.softness = softness;
  if (row.inverse_gamma > 0) row.inverse_gamma = 1 / (1 / row.inverse_gamma + softness);
}

/// The frames' origins coincide, along the world's axes, which turn with neither body.
void formulate_point(Problem& problem, const Block& x, const Placed& at, double hs) {
  const Attachment& attachment = problem.model->locks[x.source].at;
  const Vector3& arm_a = attachment.frame_a.position;
  const Vector3& arm_b = attachment.frame_b.position;
  const Vector3 offset = (at.a.linear + at.rotation_a * arm_a) - (at.b.linear + at.rotation_b * arm_b);
  for (int k = 0; k < x.rows; ++k) {
    const int axis = x.component + k;
    Row& row = problem.c.rows[x.first + k];
    set_rigid(-offset[axis] / hs, Vector3::Unit(axis), row);
    set_angular(problem, x, at, arm_a.cross(at.rotation_a.row(axis).transpose()),
                at.rotation_b.row(axis).transpose().cross(arm_b), row);
  }
}

void formulate_lock(Problem& problem, const Block& x, const Placed& at, double hs) {
  const Lock& lock = problem.model->locks[x.source];
  if (lock.kind == Lock::Kind::point) {
    formulate_point(problem, x, at, hs);
    return;
  }
  const Frames f = frames_of(lock.at, at);
  for (int k = 0; k < x.rows; ++k) {
    const int component = x.component + k;
    const int across = (lock.axis + 1 + component) % 3;
    Measured m;
    switch (lock.kind) {
      case Lock::Kind::point:
        break;
      case Lock::Kind::line:
        m = along(f, f.axes_b.col(across));
        break;
      case Lock::Kind::direction: {
        // C = axis of a · axis across it of b: its rate is (ω_a − ω_b) · (axis_a × across_b).
        const Vector3 axis_a = f.axes_a.col(lock.axis);
        const Vector3 across_b = f.axes_b.col(across);
        m = about(axis_a.dot(across_b), axis_a.cross(across_b));
        break;
      }
      case Lock::Kind::orientation: {
        // C = 2 vec(q), the rotation vector to first order; its rate by q' = ½ ω ∘ q.
        const Quaternion q = relative_rotation(f);
        const Vector3 unit = Vector3::Unit(component);
        m = about(2 * q.vec()[component], f.axes_b * (q.w() * unit + q.vec().cross(unit)));
        break;
      }
    }
    set_row(problem, x, at, m, 1, -m.value / hs, problem.c.rows[x.first + k]);
  }
}

void formulate_limit(Problem& problem, Block& x, const Placed& at, double hs) {
  const Limit& limit = problem.model->limits[x.source];
  const Measured m = measure(limit.coordinate, frames_of(limit.at, at));
  const bool two_sided = limit.side == Limit::Side::both;
  const double sign = limit.side == Limit::Side::high ? -1 : 1;
  const double room = sign * (m.value - limit.bound);  // >= 0 within the bound
  Row& row = problem.c.rows[x.first];
  set_row(problem, x, at, m, sign, -room / hs, row);
  if (!two_sided) row.low = 0;
  x.position_share = 1;
  x.stabilized = !limit.soft || !problem.c.contacts.reading.velocity_level_apart;
  if (limit.soft) {
    // λ = −hs (stiffness (room + hs Jv') + damping Jv'), in the form Jv' + softness λ = β. Within the bound β
    // lets the room close; beyond it the spring has been at work.
    const double strength = hs * limit.stiffness + limit.damping;
    if (room <= 0 || two_sided) {
      row.beta = -room * limit.stiffness / strength;
      x.position_share = hs * limit.stiffness / strength;
    }
    soften(1 / (hs * strength), row);
  }
}

void formulate_drive(Problem& problem, Block& x, const Placed& at, double hs) {
  const Drive& drive = problem.model->drives[x.source];
  const Measured m = measure(drive.coordinate, frames_of(drive.at, at));
  // The force at the step's end: λ = hs (stiffness (target − x − hs Jv') + damping (target' − Jv')).
  const double strength = hs * drive.stiffness + drive.damping;
  const double pull =
      drive.stiffness * (drive.position_target - m.value) + drive.damping * drive.velocity_target;
  Row& row = problem.c.rows[x.first];
  set_row(problem, x, at, m, 1, pull / strength, row);
  x.position_share = hs * drive.stiffness / strength;
  x.stabilized = !problem.c.contacts.reading.velocity_level_apart;
  const double mass = drive.per_mass ? row.inverse_gamma : 1;
  row.high = hs * drive.max_force * mass;
  row.low = -row.high;
  if (mass > 0) soften(1 / (hs * strength * mass), row);
}

/// J, β and M⁻¹Jᵀ of the block's rows.
void formulate_block(Problem& problem, Block& x, const Placed& at, double hs) {
  switch (x.kind) {
    case Block::Kind::lock:
      formulate_lock(problem, x, at, hs);
      break;
    case Block::Kind::limit:
      formulate_limit(problem, x, at, hs);
      break;
    case Block::Kind::drive:
      formulate_drive(problem, x, at, hs);
      break;
  }
  if (x.rows > 1) invert_gamma(problem.c, x);
}

Coordinates ahead(const Coordinates& q, const Velocity& v_local, double duration) {
  return {q.linear + duration * v_local.linear,
          compose(q.angular, rotation_quaternion(duration * v_local.angular))};
}

}  // namespace

void build_blocks(Problem& problem, Joints joints) {
  Constraints& c = problem.c;
  const Model& model = *problem.model;
  c.blocks.clear();
  c.inverse_gammas.clear();
  int first = 0;
  const auto add = [&](Block::Kind kind, int rows, int component, int a, int b,
                       std::size_t source) -> Block& {
    Block x{};
    x.kind = kind;
    x.rows = static_cast<std::uint8_t>(rows);
    x.component = static_cast<std::uint8_t>(component);
    x.first = first;
    x.a = a;
    x.b = b;
    x.source = static_cast<int>(source);
    x.inverse_mass_a = model.masses[a].inverse_mass;
    x.inverse_mass_b = model.masses[b].inverse_mass;
    first += rows;
    if (rows > 1) {
      x.coupling = static_cast<int>(c.inverse_gammas.size());
      c.inverse_gammas.emplace_back();
    }
    c.blocks.push_back(x);
    return c.blocks.back();
  };
  const auto add_lock = [&](int rows, int a, int b, std::size_t source) {
    if (joints == Joints::rows) {
      for (int k = 0; k < rows; ++k) add(Block::Kind::lock, 1, k, a, b, source);
    } else {
      add(Block::Kind::lock, rows, 0, a, b, source).stable = joints == Joints::stable;
    }
  };
  for (std::size_t i = 0; i < model.locks.size(); ++i) {
    const Lock& lock = model.locks[i];
    const int rows = lock.kind == Lock::Kind::point || lock.kind == Lock::Kind::orientation ? 3 : 2;
    add_lock(rows, lock.at.a, lock.at.b, i);
  }
  for (std::size_t i = 0; i < model.limits.size(); ++i) {
    const Limit& limit = model.limits[i];
    // A distance that is both bounds is the report's stiff spring, which is stable. Other two-sided limits
    // are not in its list; a slot that turns with its body errs the more in A5, the more sub-steps there are.
    const bool is_stiff_spring =
        limit.side == Limit::Side::both && limit.coordinate.kind == JointCoordinate::Kind::distance;
    const bool stable = joints == Joints::stable && is_stiff_spring;
    add(Block::Kind::limit, 1, 0, limit.at.a, limit.at.b, i).stable = stable;
  }
  for (std::size_t i = 0; i < model.drives.size(); ++i) {
    add(Block::Kind::drive, 1, 0, model.drives[i].at.a, model.drives[i].at.b, i);
  }
  c.contacts.build(model, *problem.contacts);
  c.rows.resize(first);
  problem.order.interleave(model, c);
}

void formulate(Problem& problem, const std::vector<Coordinates>& q, double hs) {
  problem.rotations.resize(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) problem.rotations[i] = q[i].angular.toRotationMatrix();
  for (Block& x : problem.c.blocks) {
    formulate_block(problem, x, {q[x.a], q[x.b], problem.rotations[x.a], problem.rotations[x.b]}, hs);
  }
  formulate(problem.c.contacts, *problem.model, *problem.contacts, q, problem.rotations,
            problem.frame == Frame::body, hs);
}

void update_stable(Problem& problem, Block& x, const std::vector<Velocity>& v_hat,
                   const std::vector<Velocity>* sum_v) {
  if (!x.stable) return;
  const Substeps& substeps = problem.substeps;
  const auto next_frame = [&](int body) {
    Velocity v = v_hat[body];
    if (sum_v) {
      v.linear -= (*sum_v)[body].linear;
      v.angular -= (*sum_v)[body].angular;
    }
    v.linear += substeps.offset[body].linear;
    v.angular += substeps.offset[body].angular;
    return ahead(substeps.stepped[body], v, substeps.duration);
  };
  const Coordinates a = next_frame(x.a);
  const Coordinates b = next_frame(x.b);
  Impulse beta{};
  for (int k = 0; k < x.rows; ++k) beta[k] = problem.c.rows[x.first + k].beta;
  formulate_block(problem, x, {a, b, a.angular.toRotationMatrix(), b.angular.toRotationMatrix()},
                  substeps.duration);
  for (int k = 0; k < x.rows; ++k) {
    Row& row = problem.c.rows[x.first + k];
    if (substeps.bias_at_next_frame) {
      // One Newton step on C(q + hs v') = 0 from v̂: J̆ v' = J̆ v̂ − C(q + hs v̂)/hs. A damper's share has no C.
      row.beta += x.position_share * row_velocity(row, v_hat[x.a], v_hat[x.b]);
    } else {
      row.beta = beta[k];
    }
  }
}

void add_external(const Model& model, const std::vector<Coordinates>& q, Frame frame, double duration,
                  std::vector<Velocity>& v) {
  const Vector3 fall = duration * model.gravity;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (model.masses[i].inverse_mass > 0) v[i].linear += model.masses[i].gravity_factor * fall;
  }
  for (const int i : model.gyroscopic) {
    if (frame == Frame::body) {
      v[i].angular += gyroscopic_change(v[i].angular, model.inertia[i], duration);
    } else {
      const Vector3 local = q[i].angular.conjugate() * v[i].angular;
      v[i].angular += q[i].angular * gyroscopic_change(local, model.inertia[i], duration);
    }
  }
}

void to_local(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v) {
  for (std::size_t i = 1; i < v.size(); ++i) v[i].angular = (rotations[i].transpose() * v[i].angular).eval();
}

void to_world(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v) {
  for (std::size_t i = 1; i < v.size(); ++i) v[i].angular = (rotations[i] * v[i].angular).eval();
}

void step_coordinates(double hs, const std::vector<Velocity>& v_local, std::vector<Coordinates>& q) {
  for (std::size_t i = 1; i < q.size(); ++i) q[i] = ahead(q[i], v_local[i], hs);
}

void start_substep(Problem& problem, const std::vector<Velocity>& v, const std::vector<Velocity>* sum_v) {
  Constraints& c = problem.c;
  const bool over_step = c.contacts.reading.limits_over_step;
  c.limits_of = over_step ? c.limits_of + 1 : 1;
  for (Row& row : c.rows) {
    if (over_step) row.earlier += row.impulse;
    row.impulse = 0;
  }
  start_substep(c.contacts, problem.substeps.duration, v, problem.substeps.offset, sum_v);
}

void update_biases(Problem& problem, const std::vector<Velocity>& v_local) {
  Constraints& c = problem.c;
  for (const Block& x : c.blocks) {
    if (x.position_share == 0) continue;
    for (int k = 0; k < x.rows; ++k) {
      Row& row = c.rows[x.first + k];
      row.beta -= x.position_share * row_velocity(row, v_local[x.a], v_local[x.b]);
    }
  }
  update_biases(c.contacts, problem.substeps.duration, v_local, problem.substeps.offset);
}

void box_biases(Constraints& c, double kappa, double tau) {
  for (const Block& x : c.blocks) {
    if (!x.stabilized) continue;
    for (int k = 0; k < x.rows; ++k) c.rows[x.first + k].beta *= tau / kappa;
  }
  box_biases(c.contacts, kappa, tau);
}

void undo_update_rule(Problem& problem, double kappa, double tau, const std::vector<Velocity>& change,
                      const std::vector<Velocity>& sum_v) {
  Constraints& c = problem.c;
  for (const Block& x : c.blocks) {
    // A row that is not stabilized follows the coordinates by its share of v̆, not of (τ/κ) v̆.
    const double undone = 1 - x.position_share * (x.stabilized ? 1 : kappa / tau);
    if (undone == 0) continue;
    for (int k = 0; k < x.rows; ++k) {
      Row& row = c.rows[x.first + k];
      row.beta += undone * row_velocity(row, change[x.a], change[x.b]);
    }
  }
  undo_update_rule(c.contacts, problem.substeps.duration, sum_v, problem.substeps.offset);
}

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
    out.low = -unlimited;
    out.high = unlimited;
    mlcp_.rows.push_back(out);
    return mlcp_.rows.back();
  }

  Mlcp::Row& add(const ContactBatch& x, int lane, const ContactRow& row, double beta) {
    const auto vector = [lane](const LaneVectors& v) { return Vector3(v[0][lane], v[1][lane], v[2][lane]); };
    return add(x.a[lane], x.b[lane], vector(row.linear), vector(row.angular_a), vector(row.angular_b), beta);
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
  int next_friction = x.first_friction;
  const int end_friction = x.first_friction + x.frictions;
  for (int i = 0; i < x.contacts; ++i) {
    const NormalRow& normal = contacts.normals[x.first_normal + i];
    const RestitutionRow* const bounce =
        x.first_restitution < 0 ? nullptr : &contacts.restitutions[x.first_restitution + i];
    const bool impact = bounce && bounce->impact[lane] > 0;
    writer.add(x, lane, normal.row, impact ? bounce->right[lane] : normal.row.beta[lane]).low = 0;
    if (next_friction == end_friction || contacts.frictions[next_friction].normal != i) continue;
    const int row = static_cast<int>(mlcp.rows.size()) - 1;
    const FrictionRows& friction = contacts.frictions[next_friction++];
    for (const ContactRow& tangent : friction.row) {
      Mlcp::Row& out = writer.add(x, lane, tangent, 0);
      out.normal = row;
      out.friction = friction.coefficient[lane];
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
  }
  for (const ContactBatch& x : problem.c.contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      add_manifold(problem.c.contacts, x, lane, writer, mlcp);
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
