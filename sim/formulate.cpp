#include "sim/formulate.h"

#include "sim/rotation.h"

namespace substep {
namespace {

/// What a block's rows are formulated from: its two bodies' coordinates, with rotations as matrices.
struct Placed {
  const Coordinates& a;
  const Coordinates& b;
  const Matrix3& rotation_a;
  const Matrix3& rotation_b;
};

/// Fills a row's angular parts from ᵣJᵀ in the world frame, and 1/Γ.
void set_angular(const Problem& problem, const Block& x, const Placed& at, const Vector3& world_a,
                 const Vector3& world_b, Row& row) {
  const Vector3& inverse_inertia_a = problem.model->masses[x.a].inverse_inertia;
  const Vector3& inverse_inertia_b = problem.model->masses[x.b].inverse_inertia;
  const Vector3 local_a = at.rotation_a.transpose() * world_a;  // ᵣJ̆ᵀ = R⁻¹ ᵣJᵀ (III.1)
  const Vector3 local_b = at.rotation_b.transpose() * world_b;
  const Vector3 response_a = inverse_inertia_a.cwiseProduct(local_a);
  const Vector3 response_b = inverse_inertia_b.cwiseProduct(local_b);
  const double gamma = row.linear.squaredNorm() * (x.inverse_mass_a + x.inverse_mass_b) +
                       local_a.dot(response_a) + local_b.dot(response_b);
  row.inverse_gamma = gamma > 0 ? 1 / gamma : 0;
  if (problem.frame == Frame::body) {
    row.angular_a = local_a;
    row.angular_b = local_b;
    row.response_a = response_a;
    row.response_b = response_b;
  } else {
    row.angular_a = world_a;
    row.angular_b = world_b;
    row.response_a = at.rotation_a * response_a;
    row.response_b = at.rotation_b * response_b;
  }
}

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// The row's rigid and two-sided part; its kind says what else.
Row rigid_row(double beta) {
  Row row;
  row.linear.setZero();
  row.beta = beta;
  row.low = -unlimited;
  row.high = unlimited;
  row.softness = 0;
  row.impulse = 0;
  return row;
}

/// Γ of the block's rows, inverted.
void invert_gamma(const Constraints& c, Block& x) {
  Matrix3 gamma = Matrix3::Identity();
  for (int i = 0; i < x.rows; ++i) {
    const Row& r = c.rows[x.first + i];
    for (int j = 0; j <= i; ++j) {
      const Row& s = c.rows[x.first + j];
      gamma(i, j) = gamma(j, i) = r.linear.dot(s.linear) * (x.inverse_mass_a + x.inverse_mass_b) +
                                  r.angular_a.dot(s.response_a) + r.angular_b.dot(s.response_b);
    }
  }
  x.inverse_gamma = gamma.inverse();
}

/// J, β = −C/hs and M⁻¹Jᵀ of the block's rows.
void formulate_block(Problem& problem, Block& x, const Placed& at, double hs) {
  Row* rows = &problem.c.rows[x.first];
  switch (x.kind) {
    case Block::Kind::point: {
      const PointJoint& joint = problem.model->points[x.source];
      const Vector3 arm_a = at.rotation_a * joint.anchor_a;
      const Vector3 arm_b = at.rotation_b * joint.anchor_b;
      const Vector3 gap = (at.a.linear + arm_a) - (at.b.linear + arm_b);
      for (int k = 0; k < x.rows; ++k) {
        const Vector3 axis = Vector3::Unit(x.component + k);
        Row row = rigid_row(-gap.dot(axis) / hs);
        row.linear = axis;
        row.impulse = rows[k].impulse;
        set_angular(problem, x, at, arm_a.cross(axis), axis.cross(arm_b), row);
        rows[k] = row;
      }
      break;
    }
    case Block::Kind::axis: {
      // C = axis_a · across_b: its rate is (ω_a − ω_b) · (axis_a × across_b).
      const AxisJoint& joint = problem.model->axes[x.source];
      const Vector3 axis = at.rotation_a * joint.axis_a;
      for (int k = 0; k < x.rows; ++k) {
        const Vector3 across = at.rotation_b * (x.component + k == 0 ? joint.across_b1 : joint.across_b2);
        const Vector3 turn = axis.cross(across);
        Row row = rigid_row(-axis.dot(across) / hs);
        row.impulse = rows[k].impulse;
        set_angular(problem, x, at, turn, -turn, row);
        rows[k] = row;
      }
      break;
    }
    case Block::Kind::drive: {
      const VelocityDrive& drive = problem.model->drives[x.source];
      const Vector3 axis = at.rotation_b * drive.axis_b;
      Row row = rigid_row(drive.velocity_target);
      set_angular(problem, x, at, axis, -axis, row);
      // The torque of the step's end, damping · (target − ω'), as an impulse: λ = hs · damping · (β − Jv').
      const double inertia = drive.per_inertia ? row.inverse_gamma : 1;
      row.softness = 1 / (hs * drive.damping * inertia);
      row.high = hs * drive.max_torque * inertia;
      row.low = -row.high;
      row.inverse_gamma = 1 / (1 / row.inverse_gamma + row.softness);
      rows[0] = row;
      break;
    }
    case Block::Kind::contact_normal: {
      const Contact& contact = (*problem.contacts)[x.source];
      const Vector3 arm_a = at.rotation_a * contact.arm_a;
      const Vector3 arm_b = at.rotation_b * contact.arm_b;
      const Vector3 normal = at.rotation_b * contact.normal_b;
      const Vector3 gap = (at.a.linear - at.b.linear) + (arm_a - arm_b);
      // A positive distance is admitted too: β lets it close, no more.
      Row row = rigid_row(-gap.dot(normal) / hs);
      row.linear = normal;
      row.low = 0;
      set_angular(problem, x, at, arm_a.cross(normal), normal.cross(arm_b), row);
      rows[0] = row;
      break;
    }
    case Block::Kind::contact_friction: {
      const Contact& contact = (*problem.contacts)[x.source];
      const Vector3 arm_a = at.rotation_a * contact.arm_a;
      const Vector3 arm_b = at.rotation_b * contact.arm_b;
      const Vector3 tangent = at.rotation_b * (x.component == 0 ? contact.tangent_b1 : contact.tangent_b2);
      Row row = rigid_row(0);
      row.linear = tangent;
      set_angular(problem, x, at, arm_a.cross(tangent), tangent.cross(arm_b), row);
      rows[0] = row;
      break;
    }
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
  c.blocks.reserve(3 * problem.contacts->capacity());
  c.rows.reserve(3 * problem.contacts->capacity());
  int first = 0;
  const auto add = [&](Block::Kind kind, int rows, int component, int a, int b,
                       std::size_t source) -> Block& {
    Block x{};
    x.kind = kind;
    x.position_level = kind != Block::Kind::drive && kind != Block::Kind::contact_friction;
    x.rows = static_cast<std::uint8_t>(rows);
    x.component = static_cast<std::uint8_t>(component);
    x.first = first;
    x.a = a;
    x.b = b;
    x.source = static_cast<int>(source);
    x.inverse_mass_a = model.masses[a].inverse_mass;
    x.inverse_mass_b = model.masses[b].inverse_mass;
    first += rows;
    c.blocks.push_back(x);
    return c.blocks.back();
  };
  const auto add_joint = [&](Block::Kind kind, int rows, int a, int b, std::size_t source) {
    if (joints == Joints::rows) {
      for (int k = 0; k < rows; ++k) add(kind, 1, k, a, b, source);
    } else {
      add(kind, rows, 0, a, b, source).stable = joints == Joints::stable;
    }
  };
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    add_joint(Block::Kind::point, 3, model.points[i].a, model.points[i].b, i);
  }
  for (std::size_t i = 0; i < model.axes.size(); ++i) {
    add_joint(Block::Kind::axis, 2, model.axes[i].a, model.axes[i].b, i);
  }
  for (std::size_t i = 0; i < model.drives.size(); ++i) {
    add(Block::Kind::drive, 1, 0, model.drives[i].a, model.drives[i].b, i);
  }
  // Contacts by pairs of bodies: a pair's normals, then its friction, which needs their impulses.
  const std::vector<Contact>& contacts = *problem.contacts;
  for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
    const int first_normal = first;
    while (end < contacts.size() && contacts[end].a == contacts[begin].a &&
           contacts[end].b == contacts[begin].b) {
      add(Block::Kind::contact_normal, 1, 0, contacts[end].a, contacts[end].b, end);
      ++end;
    }
    for (std::size_t i = begin; i < end; ++i) {
      if (contacts[i].friction == 0) continue;
      for (int k = 0; k < 2; ++k) {
        Block& x = add(Block::Kind::contact_friction, 1, k, contacts[i].a, contacts[i].b, i);
        x.normal = first_normal + static_cast<int>(i - begin);
        x.friction = contacts[i].friction;
      }
    }
  }
  c.rows.resize(first);
}

void formulate(Problem& problem, const std::vector<Coordinates>& q, double hs) {
  problem.rotations.resize(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) problem.rotations[i] = q[i].angular.toRotationMatrix();
  for (Block& x : problem.c.blocks) {
    formulate_block(problem, x, {q[x.a], q[x.b], problem.rotations[x.a], problem.rotations[x.b]}, hs);
  }
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
      // One Newton step on C(q + hs v') = 0 from v̂: J̆ v' = J̆ v̂ − C(q + hs v̂)/hs.
      row.beta += row_velocity(row, v_hat[x.a], v_hat[x.b]);
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

void step_coordinates(double hs, const std::vector<Velocity>& v_local, std::vector<Coordinates>& q) {
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = ahead(q[i], v_local[i], hs);
}

void update_biases(Constraints& c, const std::vector<Velocity>& v_local) {
  for (const Block& x : c.blocks) {
    if (!x.position_level) continue;
    for (int k = 0; k < x.rows; ++k) {
      Row& row = c.rows[x.first + k];
      row.beta -= row_velocity(row, v_local[x.a], v_local[x.b]);
    }
  }
}

void box_biases(Constraints& c, double kappa, double tau) {
  for (Row& row : c.rows) row.beta *= tau / kappa;
}

void undo_update_rule(Constraints& c, const std::vector<Velocity>& change) {
  for (const Block& x : c.blocks) {
    if (x.position_level) continue;
    for (int k = 0; k < x.rows; ++k) {
      Row& row = c.rows[x.first + k];
      row.beta += row_velocity(row, change[x.a], change[x.b]);
    }
  }
}

void make_mlcp(const Problem& problem, const std::vector<Velocity>& v, Mlcp& mlcp) {
  const Model& model = *problem.model;
  const auto moves = [&](int body) {
    return model.masses[body].inverse_mass > 0 || model.masses[body].inverse_inertia.maxCoeff() > 0;
  };
  const auto part = [&](int body, const Vector3& linear, const Vector3& angular) {
    const BodyMass& mass = model.masses[body];
    Vector6 result;
    result.head<3>() = linear * std::sqrt(mass.inverse_mass);
    result.tail<3>() =
        (problem.rotations[body].transpose() * angular).cwiseProduct(mass.inverse_inertia.cwiseSqrt());
    return result;
  };
  mlcp.bodies = static_cast<int>(model.masses.size());
  mlcp.rows.resize(problem.c.rows.size());
  for (const Block& x : problem.c.blocks) {
    const Row& row = problem.c.rows[x.first];
    Mlcp::Row& out = mlcp.rows[x.first];
    out.a = moves(x.a) ? x.a : -1;
    out.b = moves(x.b) ? x.b : -1;
    out.part_a = part(x.a, row.linear, row.angular_a);
    out.part_b = part(x.b, -row.linear, row.angular_b);
    out.right = row.beta - row_velocity(row, v[x.a], v[x.b]);
    out.low = row.low;
    out.high = row.high;
    out.softness = row.softness;
    out.normal = x.kind == Block::Kind::contact_friction ? x.normal : -1;
    out.friction = x.friction;
  }
}

}  // namespace substep
