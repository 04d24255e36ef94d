#include "sim/geometry/mass_properties.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/geometry/triangle_mesh.h"

namespace substep {
namespace {

Matrix3 inertia_of_second_moment(const Matrix3& second_moment) {
  return second_moment.trace() * Matrix3::Identity() - second_moment;
}

/// A sum of tetrahedra that have one corner in common. The other corners are given relative to it.
class TetrahedronSum {
 public:
  void add(const Vector3& a, const Vector3& b, const Vector3& c) {
    const double six_volumes = a.dot(b.cross(c));
    const Vector3 sum = a + b + c;
    six_volumes_ += six_volumes;
    moment_ += six_volumes / 24 * sum;
    // Sum the lower half alone: the matrix is symmetric.
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j <= i; ++j) {
        second_moment_(i, j) +=
            six_volumes / 120 * (sum[i] * sum[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]);
      }
    }
  }

  MassProperties result(const Vector3& corner) const {
    MassProperties properties;
    properties.mass = six_volumes_ / 6;
    if (properties.mass == 0) return properties;
    const Vector3 centre = moment_ / properties.mass;
    properties.centre_of_mass = corner + centre;
    const Matrix3 second_moment = second_moment_.selfadjointView<Eigen::Lower>();
    properties.inertia =
        inertia_of_second_moment(second_moment - properties.mass * centre * centre.transpose());
    return properties;
  }

 private:
  double six_volumes_ = 0;
  Vector3 moment_ = Vector3::Zero();
  Matrix3 second_moment_ = Matrix3::Zero();
};

Vector3 mean(std::span<const Vector3> points) {
  // Sum relative to the first point, so that a small mesh far from the origin keeps its digits.
  Vector3 sum = Vector3::Zero();
  for (const Vector3& point : points) sum += point - points[0];
  return points[0] + sum / static_cast<double>(points.size());
}

MassProperties of_shape(const Sphere& sphere) {
  const double r = sphere.radius;
  MassProperties properties;
  properties.mass = 4.0 / 3 * std::numbers::pi * r * r * r;
  properties.inertia = 0.4 * properties.mass * r * r * Matrix3::Identity();
  return properties;
}

MassProperties of_shape(const Capsule& capsule) {
  const double r = capsule.radius;
  const double length = 2 * capsule.half_length;
  const double cylinder = std::numbers::pi * r * r * length;
  const double ball = 4.0 / 3 * std::numbers::pi * r * r * r;
  MassProperties properties;
  properties.mass = cylinder + ball;
  const double along = cylinder * r * r / 2 + ball * 0.4 * r * r;
  // A hemisphere's centre of mass is 3r/8 from its flat side, which lies half a length from the origin.
  const double across = cylinder * (length * length / 12 + r * r / 4) +
                        ball * (0.4 * r * r + length * length / 4 + 0.375 * length * r);
  properties.inertia = Vector3(across, along, across).asDiagonal();
  return properties;
}

/// Returns the properties of a plane or a triangle mesh, which have no mass.
template <class Massless>
MassProperties of_shape(const Massless& /*shape*/) {
  return {};
}

/// A solid of revolution about the Y axis, in pieces whose squared radius is a polynomial in y.
class RevolvedSum {
 public:
  /// Adds a cone frustum: from (y = low, radius_low) straight to (high, radius_high).
  void add_frustum(double low, double radius_low, double high, double radius_high) {
    const double h = (high - low) / 2;
    if (h <= 0) return;
    // Integrate about the middle, where odd powers of y vanish: r = m + k y.
    const double m = (radius_low + radius_high) / 2;
    const double k = (radius_high - radius_low) / (2 * h);
    const double y2 = 2 * h * h * h / 3;
    const double y4 = 2 * h * h * h * h * h / 5;
    add((low + high) / 2, 2 * h * m * m + k * k * y2, 2 * m * k * y2, m * m * y2 + k * k * y4,
        2 * h * m * m * m * m + 6 * m * m * k * k * y2 + k * k * k * k * y4);
  }

  /// Adds the part between y = centre + low and centre + high of a ball of this radius.
  void add_ball_part(double centre, double radius, double low, double high) {
    const auto integral = [&](double u) -> std::array<double, 4> {
      const double r2 = radius * radius;
      const double u2 = u * u;
      return {r2 * u - u2 * u / 3, r2 * u2 / 2 - u2 * u2 / 4, r2 * u2 * u / 3 - u2 * u2 * u / 5,
              r2 * r2 * u - 2 * r2 * u2 * u / 3 + u2 * u2 * u / 5};
    };
    const std::array<double, 4> to = integral(high);
    const std::array<double, 4> from = integral(low);
    add(centre, to[0] - from[0], to[1] - from[1], to[2] - from[2], to[3] - from[3]);
  }

  MassProperties result() const {
    MassProperties properties;
    properties.mass = std::numbers::pi * area_;
    if (properties.mass == 0) return properties;
    const double centre = first_ / area_;
    properties.centre_of_mass.y() = centre;
    const double across = std::numbers::pi * (fourth_ / 4 + second_ - centre * first_);
    properties.inertia = Vector3(across, std::numbers::pi * fourth_ / 2, across).asDiagonal();
    return properties;
  }

 private:
  /// Adds ∫ r², ∫ y r², ∫ y² r² and ∫ r⁴ of a piece, with y from `offset`.
  void add(double offset, double area, double first, double second, double fourth) {
    area_ += area;
    first_ += first + offset * area;
    second_ += second + 2 * offset * first + offset * offset * area;
    fourth_ += fourth;
  }

  double area_ = 0;
  double first_ = 0;
  double second_ = 0;
  double fourth_ = 0;
};

MassProperties of_shape(const Cylinder& cylinder) {
  RevolvedSum sum;
  sum.add_frustum(-cylinder.half_height, cylinder.radius_bottom, cylinder.half_height, cylinder.radius_top);
  return sum.result();
}

MassProperties of_shape(const TaperedCapsule& capsule) {
  const double h = capsule.half_length;
  const double bottom = capsule.radius_bottom;
  const double top = capsule.radius_top;
  RevolvedSum sum;
  if (std::abs(bottom - top) >= 2 * h) {
    sum.add_ball_part(bottom > top ? -h : h, std::max(bottom, top), -std::max(bottom, top),
                      std::max(bottom, top));
    return sum.result();
  }
  // The straight side touches both balls where their normal has this sine.
  const double sine = (bottom - top) / (2 * h);
  const double cosine = std::sqrt(1 - sine * sine);
  sum.add_ball_part(-h, bottom, -bottom, bottom * sine);
  sum.add_frustum(-h + bottom * sine, bottom * cosine, h + top * sine, top * cosine);
  sum.add_ball_part(h, top, top * sine, top);
  return sum.result();
}

MassProperties of_shape(const Polytope& polytope) {
  if (polytope.ellipsoid) {
    const Vector3& half = *polytope.ellipsoid;
    MassProperties properties;
    properties.mass = 4.0 / 3 * std::numbers::pi * half.prod();
    properties.inertia =
        inertia_of_second_moment((properties.mass / 5 * half.cwiseAbs2()).asDiagonal().toDenseMatrix());
    return properties;
  }
  const Vector3 corner = mean(polytope.vertices);
  TetrahedronSum sum;
  for (std::size_t f = 0; f < polytope.face_count(); ++f) {
    const auto vertex = [&](std::uint32_t i) -> Vector3 {
      return polytope.vertices[polytope.face_vertices[i]] - corner;
    };
    const std::uint32_t first = polytope.face_begin[f];
    for (std::uint32_t i = first + 1; i + 1 < polytope.face_begin[f + 1]; ++i) {
      sum.add(vertex(first), vertex(i), vertex(i + 1));
    }
  }
  return sum.result(corner);
}

/// Returns, of the 24 ways to name the axes of `rotation` (columns) that keep them right-handed, the one
/// nearest to the given axes: the first of the greatest trace.
std::array<int, 3> nearest_names(const Matrix3& rotation, std::array<double, 3>& signs) {
  constexpr std::array<std::array<int, 3>, 6> orders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  std::array<int, 3> best = orders[0];
  double best_trace = -infinity;
  for (std::size_t o = 0; o < orders.size(); ++o) {
    const double handedness = o < 3 ? 1 : -1;
    for (int flip = 0; flip < 4; ++flip) {
      const double first = (flip & 1) != 0 ? -1 : 1;
      const double second = (flip & 2) != 0 ? -1 : 1;
      const std::array<double, 3> candidate = {first, second, handedness * first * second};
      double trace = 0;
      for (int axis = 0; axis < 3; ++axis) {
        trace += candidate[static_cast<std::size_t>(axis)] *
                 rotation(axis, orders[o][static_cast<std::size_t>(axis)]);
      }
      // Require a clear gain, so that rounding does not choose between equal ones.
      if (trace <= best_trace + 1e-12) continue;
      best_trace = trace;
      best = orders[o];
      signs = candidate;
    }
  }
  return best;
}

}  // namespace

MassProperties mass_properties(std::span<const Vector3> vertices, std::span<const Triangle> triangles) {
  if (vertices.empty()) return {};
  const Vector3 corner = mean(vertices);
  TetrahedronSum sum;
  for (const Triangle& triangle : triangles) {
    sum.add(vertices[triangle[0]] - corner, vertices[triangle[1]] - corner, vertices[triangle[2]] - corner);
  }
  return sum.result(corner);
}

MassProperties mass_properties(const Shape& shape) {
  return std::visit([](const auto& solid) { return of_shape(solid); }, shape);
}

bool is_closed(std::span<const Vector3> vertices, std::span<const Triangle> triangles) {
  if (!std::ranges::all_of(vertices, [](const Vector3& vertex) { return vertex.allFinite(); })) return false;
  const std::vector<std::uint32_t> weld = welded(vertices);
  std::vector<Triangle> kept;
  for (Triangle corners : triangles) {
    if (std::ranges::max(corners) >= vertices.size()) return false;
    for (std::uint32_t& corner : corners) corner = weld[corner];
    // Skip a triangle whose corners are welded to a line.
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    kept.push_back(corners);
  }
  return !kept.empty() && are_paired(sorted_sides(kept));
}

MassProperties transformed(const MassProperties& properties, const Pose& pose) {
  const Matrix3 rotation = pose.orientation.toRotationMatrix();
  return {properties.mass, pose * properties.centre_of_mass,
          rotation * properties.inertia * rotation.transpose()};
}

MassProperties combined(const MassProperties& a, const MassProperties& b) {
  if (b.mass == 0) return a;
  if (a.mass == 0) return b;
  MassProperties sum;
  sum.mass = a.mass + b.mass;
  const Vector3 offset = b.centre_of_mass - a.centre_of_mass;
  sum.centre_of_mass = a.centre_of_mass + b.mass / sum.mass * offset;
  const Matrix3 of_offset = offset.squaredNorm() * Matrix3::Identity() - offset * offset.transpose();
  sum.inertia = a.inertia + b.inertia + a.mass * b.mass / sum.mass * of_offset;
  return sum;
}

MassProperties with_mass(const MassProperties& properties, double mass) {
  MassProperties result = properties;
  result.mass = mass;
  if (properties.mass != 0) result.inertia *= mass / properties.mass;
  return result;
}

PrincipalInertia principal_inertia(const Matrix3& inertia) {
  Matrix3 matrix = (inertia + inertia.transpose()) / 2;
  Matrix3 rotation = Matrix3::Identity();
  // Ignore products of inertia below the rounding of the sums they came from: a cube keeps its axes.
  const double negligible = 1e-14 * matrix.diagonal().cwiseAbs().maxCoeff();
  // Sweep until all products vanish. Convergence is quadratic: five sweeps are enough for any 3×3 matrix.
  for (int sweep = 0; sweep < 12; ++sweep) {
    bool done = true;
    for (const auto& [p, q] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      if (std::abs(matrix(p, q)) <= negligible) continue;
      done = false;
      // Turn by the smaller angle that makes the pair's product of inertia zero (Jacobi).
      const double cotangent = (matrix(q, q) - matrix(p, p)) / (2 * matrix(p, q));
      const double tangent =
          (cotangent >= 0 ? 1 : -1) / (std::abs(cotangent) + std::sqrt(cotangent * cotangent + 1));
      const double cosine = 1 / std::sqrt(tangent * tangent + 1);
      const double sine = tangent * cosine;
      Matrix3 turn = Matrix3::Identity();
      turn(p, p) = turn(q, q) = cosine;
      turn(p, q) = sine;
      turn(q, p) = -sine;
      matrix = turn.transpose() * matrix * turn;
      matrix(p, q) = matrix(q, p) = 0;
      rotation = rotation * turn;
    }
    if (done) break;
  }
  std::array<double, 3> signs = {1, 1, 1};
  const std::array<int, 3> names = nearest_names(rotation, signs);
  PrincipalInertia result;
  Matrix3 axes;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    result.moments[axis] = matrix(names[i], names[i]);
    axes.col(axis) = signs[i] * rotation.col(names[i]);
  }
  result.orientation = Quaternion(axes).normalized();
  return result;
}

}  // namespace substep
