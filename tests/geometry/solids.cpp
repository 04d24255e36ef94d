#include "tests/geometry/solids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/triangle_mesh.h"

namespace substep::test {

std::vector<Vector3> dodecahedron_points() {
  constexpr double phi = std::numbers::phi;
  std::vector<Vector3> points;
  for (int corner = 0; corner < 8; ++corner) {
    points.emplace_back((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
  }
  for (const double s : {1.0, -1.0}) {
    for (const double t : {1.0, -1.0}) {
      points.emplace_back(0, s / phi, t * phi);
      points.emplace_back(s / phi, t * phi, 0);
      points.emplace_back(s * phi, 0, t / phi);
    }
  }
  return points;
}

Polytope dodecahedron() {
  return convex_hull(dodecahedron_points(), "dodecahedron");
}

Polytope random_hull(std::mt19937& random, int count) {
  std::normal_distribution<double> normal;
  std::vector<Vector3> points;
  points.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) points.emplace_back(normal(random), normal(random), normal(random));
  return convex_hull(points, "random points");
}

std::vector<Shape> round_shapes() {
  return {Sphere{0.4},
          Capsule{0.5, 0.2},
          Capsule{0.6, 0.3},
          make_cylinder(1, 0.5, 0.5),
          make_cylinder(0.1, 0.5, 0.5),
          make_cylinder(2, 0.1, 0.1),
          make_cylinder(1, 0.5, 0.2),
          make_cylinder(0.8, 0, 0.4),
          make_tapered_capsule(1, 0.3, 0.1),
          make_tapered_capsule(0.3, 0.2, 0.4)};
}

Polytope transformed(const Polytope& polytope, const Pose& pose) {
  Polytope result = polytope;
  for (Vector3& vertex : result.vertices) vertex = pose * vertex;
  result.half_box.reset();
  return scaled(result, Vector3::Ones());  // measures the faces
}

Vector3 grid_point(int i, int side) {
  return Eigen::Vector3i(i % side, i / side % side, i / (side * side)).cast<double>();
}

Quaternion random_orientation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double w = normal(random);
  const double x = normal(random);
  const double y = normal(random);
  return Quaternion(w, x, y, normal(random)).normalized();
}

Vector3 random_point(std::mt19937& random, double reach) {
  std::uniform_real_distribution<double> uniform(-reach, reach);
  const double x = uniform(random);
  const double y = uniform(random);
  return {x, y, uniform(random)};
}

Quaternion turn(double angle, const Vector3& axis) {
  const Vector3 part = std::sin(angle / 2) * axis.normalized();
  return {std::cos(angle / 2), part.x(), part.y(), part.z()};
}

int oracle_pairs(int usual) {
  const char* wanted = std::getenv("SUBSTEP_ORACLE_PAIRS");
  return wanted ? std::atoi(wanted) : usual;
}

TriangleMesh flat_mesh(int side, double cell, double uneven) {
  std::mt19937 random(11);
  std::vector<Vector3> positions;
  std::vector<Triangle> triangles;
  const auto at = [&](int i, int k) { return static_cast<std::uint32_t>(i * (side + 1) + k); };
  for (int i = 0; i <= side; ++i) {
    for (int k = 0; k <= side; ++k) {
      const bool inner = i > 0 && k > 0 && i < side && k < side;
      const Vector3 shift = inner ? Vector3(uneven * cell * random_point(random, 1)) : Vector3::Zero();
      positions.emplace_back((i - side / 2) * cell + shift.x(), 0, (k - side / 2) * cell + shift.z());
    }
  }
  for (int i = 0; i < side; ++i) {
    for (int k = 0; k < side; ++k) {
      if (uneven > 0 && random() % 2 == 0) {
        triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k)});
        triangles.push_back({at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)});
      } else {
        triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
        triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
      }
    }
  }
  return make_triangle_mesh(positions, triangles, "flat mesh");
}

std::vector<Triangle> triangles_of(const Polytope& polytope) {
  std::vector<Triangle> triangles;
  for (std::size_t f = 0; f < polytope.face_count(); ++f) {
    const std::uint32_t* corners = polytope.face_vertices.data() + polytope.face_begin[f];
    const std::uint32_t count = polytope.face_begin[f + 1] - polytope.face_begin[f];
    for (std::uint32_t i = 1; i + 1 < count; ++i)
      triangles.push_back({corners[0], corners[i], corners[i + 1]});
  }
  return triangles;
}

Contacts contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double margin) {
  Contacts points;
  find_contacts(a, pose_a, b, pose_b, margin, points);
  return points;
}

double lowest_distance(const Contacts& points) {
  double lowest = infinity;
  for (const ContactPoint& point : points) lowest = std::min(lowest, point.distance);
  return lowest;
}

std::string complaint(const Contacts& points, double margin) {
  for (const ContactPoint& point : points) {
    if (!point.on_a.allFinite() || !point.on_b.allFinite() || !point.normal.allFinite() ||
        !std::isfinite(point.distance)) {
      return "not finite";
    }
    if (std::abs(point.normal.norm() - 1) > 1e-12) return "normal is not unit";
    if (std::abs((point.on_a - point.on_b).dot(point.normal) - point.distance) > 1e-11) {
      return "distance is not that of its points";
    }
    if ((point.on_a - point.on_b - point.distance * point.normal).norm() > 1e-5) {
      return "points are not across from each other";
    }
    if (point.distance >= margin) return "beyond the margin";
  }
  return {};
}

void expect_mirrored(const Contacts& one, const Contacts& other) {
  ASSERT_EQ(one.size(), other.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].on_a, other[i].on_b);
    EXPECT_EQ(one[i].on_b, other[i].on_a);
    EXPECT_EQ(one[i].normal, -other[i].normal);
    EXPECT_EQ(one[i].distance, other[i].distance);
  }
}

double extent(const Shape& shape, const Pose& pose, const Vector3& direction) {
  const Vector3 d = pose.orientation.conjugate() * direction;
  const double flat = std::sqrt(d.x() * d.x() + d.z() * d.z());
  double local = -infinity;
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    local = sphere->radius;
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    local = capsule->half_length * std::abs(d.y()) + capsule->radius;
  } else if (const auto* tapered = std::get_if<TaperedCapsule>(&shape)) {
    local = std::max(tapered->half_length * d.y() + tapered->radius_top,
                     -tapered->half_length * d.y() + tapered->radius_bottom);
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    local = std::max(cylinder->half_height * d.y() + cylinder->radius_top * flat,
                     -cylinder->half_height * d.y() + cylinder->radius_bottom * flat);
  } else if (const auto* polytope = std::get_if<Polytope>(&shape)) {
    for (const Vector3& vertex : polytope->vertices) local = std::max(local, d.dot(vertex));
  }
  return local + direction.dot(pose.position);
}

double brute_separation(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b) {
  const Shape shape_a = a;
  const Shape shape_b = b;
  double best = -infinity;
  const auto look_along = [&](const Vector3& axis) {
    for (const Vector3& n : {axis, Vector3(-axis)}) {
      best = std::max(best, -extent(shape_a, pose_a, -n) - extent(shape_b, pose_b, n));
    }
  };
  for (const Vector3& normal : a.face_normals) look_along(pose_a.orientation * normal);
  for (const Vector3& normal : b.face_normals) look_along(pose_b.orientation * normal);
  for (const auto& [from_a, to_a] : a.edges) {
    const Vector3 along = pose_a.orientation * (a.vertices[to_a] - a.vertices[from_a]);
    for (const auto& [from_b, to_b] : b.edges) {
      const Vector3 axis = along.cross(pose_b.orientation * (b.vertices[to_b] - b.vertices[from_b]));
      if (axis.norm() > 1e-9) look_along(axis.normalized());
    }
  }
  return best;
}

}  // namespace substep::test
