#include "tests/geometry/solids.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "sim/geometry/convex_hull.h"
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

Polytope random_hull(std::mt19937& random, int count) {
  std::normal_distribution<double> normal;
  std::vector<Vector3> points;
  points.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) points.emplace_back(normal(random), normal(random), normal(random));
  return convex_hull(points, "random points");
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

std::vector<ContactPoint> contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b,
                                   double margin) {
  std::vector<ContactPoint> points;
  find_contacts(a, pose_a, b, pose_b, margin, points);
  return points;
}

double lowest_distance(const std::vector<ContactPoint>& points) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const ContactPoint& point : points) lowest = std::min(lowest, point.distance);
  return lowest;
}

std::string complaint(const std::vector<ContactPoint>& points, double margin) {
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

double brute_separation(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b) {
  std::vector<Vector3> points_a;
  std::vector<Vector3> points_b;
  for (const Vector3& vertex : a.vertices) points_a.push_back(pose_a * vertex);
  for (const Vector3& vertex : b.vertices) points_b.push_back(pose_b * vertex);
  double best = -std::numeric_limits<double>::infinity();
  const auto look_along = [&](const Vector3& axis) {
    double low_a = std::numeric_limits<double>::infinity();
    double low_b = low_a;
    double high_a = -low_a;
    double high_b = -low_a;
    for (const Vector3& point : points_a) {
      low_a = std::min(low_a, axis.dot(point));
      high_a = std::max(high_a, axis.dot(point));
    }
    for (const Vector3& point : points_b) {
      low_b = std::min(low_b, axis.dot(point));
      high_b = std::max(high_b, axis.dot(point));
    }
    best = std::max({best, low_b - high_a, low_a - high_b});
  };
  for (const Vector3& normal : a.face_normals) look_along(pose_a.orientation * normal);
  for (const Vector3& normal : b.face_normals) look_along(pose_b.orientation * normal);
  for (const auto& edge_a : a.edges) {
    for (const auto& edge_b : b.edges) {
      const Vector3 axis =
          (points_a[edge_a[1]] - points_a[edge_a[0]]).cross(points_b[edge_b[1]] - points_b[edge_b[0]]);
      if (axis.norm() > 1e-9) look_along(axis.normalized());
    }
  }
  return best;
}

}  // namespace substep::test
