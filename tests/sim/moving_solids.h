#pragma once
/// Solids for tests of moving contacts, and their distance by a method that shares nothing with sim/geometry.

#include <Eigen/LU>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/triangle_mesh.h"
#include "tests/sim/random_trials.h"

namespace substep::test {

/// A convex set: the hull of points, or of discs across y about them, rounded by a ball of radius `round`.
struct Core {
  std::vector<Vector3> corners;
  std::vector<double> disc;  ///< radius of the disc about each corner; empty: points
  double round = 0;          ///< m

  /// Returns the farthest point of the set at `pose` along a unit direction.
  Vector3 support(const Pose& pose, const Vector3& direction) const {
    const Vector3 along = pose.orientation.conjugate() * direction;
    Vector3 flat(along.x(), 0, along.z());
    if (flat.squaredNorm() > 0) flat.normalize();
    Vector3 best = Vector3::Zero();
    double height = -infinity;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vector3 point = disc.empty() ? corners[i] : Vector3(corners[i] + disc[i] * flat);
      if (along.dot(point) <= height) continue;
      height = along.dot(point);
      best = point;
    }
    return pose * (best + round * along);
  }

  /// Returns a bound of the distance of points from the origin, m.
  double reach() const {
    double largest = 0;
    for (std::size_t i = 0; i < corners.size(); ++i)
      largest = std::max(largest, corners[i].norm() + (disc.empty() ? 0.0 : disc[i]));
    return largest + round;
  }
};

/// A collider, and the same set as a Core.
struct Part {
  Shape shape;
  Pose placement;
  Core core;
};

/// The colliders of a body, placed in its frame.
struct Solid {
  std::string name;
  std::vector<Part> parts;

  double reach() const {
    double largest = 0;
    for (const Part& part : parts)
      largest = std::max(largest, part.placement.position.norm() + part.core.reach());
    return largest;
  }
};

inline Solid ball(double radius) {
  return {"ball", {{Sphere{radius}, {}, {{Vector3::Zero()}, {}, radius}}}};
}

inline Solid capsule(double half_length, double radius) {
  return {"capsule",
          {{Capsule{half_length, radius}, {}, {{{0, -half_length, 0}, {0, half_length, 0}}, {}, radius}}}};
}

/// Returns a cylinder; with unequal radii a frustum or a cone.
inline Solid cylinder(double half_height, double radius_bottom, double radius_top) {
  return {radius_top > 0 ? "cylinder" : "cone",
          {{Cylinder{half_height, radius_bottom, radius_top},
            {},
            {{{0, -half_height, 0}, {0, half_height, 0}}, {radius_bottom, radius_top}, 0}}}};
}

inline std::vector<Vector3> box_corners(const Vector3& size) {
  std::vector<Vector3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back(0.5 * size.cwiseProduct(Vector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  return corners;
}

inline Solid box_of(const Vector3& size) {
  return {"box", {{box(size), {}, {box_corners(size), {}, 0}}}};
}

inline Solid hull_of(const std::vector<Vector3>& points) {
  return {"hull", {{convex_hull(points, "hull"), {}, {points, {}, 0}}}};
}

/// Returns a box as a hull, which the solver does not know to be a box.
inline Solid box_hull(const Vector3& size) {
  return hull_of(box_corners(size));
}

/// Returns a closed mesh of a box, for static bodies.
inline Solid box_mesh(const Vector3& size) {
  Solid solid = box_of(size);
  const std::vector<Triangle> triangles{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                        {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  solid.name = "mesh";
  solid.parts[0].shape = make_triangle_mesh(solid.parts[0].core.corners, triangles, "mesh");
  return solid;
}

/// Returns a rectangle of two triangles in y = 0 that face up.
inline Solid rectangle_mesh(double size_x, double size_z) {
  return {"rectangle",
          {{make_rectangle(size_x, size_z, false), {}, {box_corners({size_x, 0, size_z}), {}, 0}}}};
}

/// Returns a solid of about `size` from the middle to the farthest corner.
inline Solid random_solid(Random& random, double size) {
  const auto part = [&] { return size * random.between(0.2, 0.6); };
  switch (random.below(8)) {
    case 0:
      return ball(size);
    case 1:
      return capsule(part(), part());
    case 2:
      return cylinder(part(), part(), part());
    case 3:
      return cylinder(part(), part(), 0);
    case 4:
      return box_of(2 * Vector3(part(), part(), part()));
    case 5: {
      Solid blade = box_of(2 * size * Vector3(1, random.between(0.02, 0.1), random.between(0.05, 0.2)));
      blade.name = "blade";
      return blade;
    }
    case 6: {
      std::vector<Vector3> points;
      for (int i = 0; i < 12; ++i) points.emplace_back(size * random.direction());
      return hull_of(points);
    }
    default: {
      Solid compound = box_of(2 * Vector3(part(), part(), part()));
      compound.parts[0].placement = {0.4 * size * random.direction(), random.orientation()};
      compound.parts.push_back(ball(part()).parts[0]);
      compound.parts[1].placement.position = -0.4 * size * random.direction();
      compound.name = "compound";
      return compound;
    }
  }
}

/// Returns the point of the convex hull of `simplex` nearest to the origin; reduces `simplex` to the corners
/// that the point lies between.
inline Vector3 nearest_to_origin(std::vector<Vector3>& simplex) {
  Vector3 best = simplex[0];
  std::vector<Vector3> kept{simplex[0]};
  double least = infinity;
  for (unsigned mask = 1; mask < 1U << simplex.size(); ++mask) {
    std::vector<Vector3> corners;
    for (std::size_t i = 0; i < simplex.size(); ++i) {
      if (mask >> i & 1U) corners.push_back(simplex[i]);
    }
    const auto count = static_cast<Eigen::Index>(corners.size()) - 1;
    Vector3 point = corners[0];
    double of_first = 1;
    if (count > 0) {
      Eigen::Matrix<double, 3, Eigen::Dynamic> edges(3, count);
      for (Eigen::Index i = 0; i < count; ++i)
        edges.col(i) = corners[static_cast<std::size_t>(i) + 1] - corners[0];
      const Eigen::VectorXd weights =
          (edges.transpose() * edges).fullPivLu().solve(-edges.transpose() * corners[0]);
      if (weights.minCoeff() < 0) continue;
      of_first = 1 - weights.sum();
      if (of_first < 0) continue;
      point += edges * weights;
    }
    if (point.squaredNorm() >= least) continue;
    least = point.squaredNorm();
    best = point;
    kept = corners;
  }
  simplex = kept;
  return best;
}

/// Returns a lower bound of the distance of two convex sets, within 1 % (Gilbert, Johnson and Keerthi 1988):
/// the width of the slab between their supports along the direction found. 0 where they meet.
inline double distance(const Core& a, const Pose& pose_a, const Core& b, const Pose& pose_b) {
  const auto support = [&](const Vector3& direction) {
    return Vector3(a.support(pose_a, direction) - b.support(pose_b, -direction));
  };
  std::vector<Vector3> simplex{support(Vector3(0.6, 0.64, 0.48))};
  Vector3 nearest = simplex[0];
  double bound = 0;
  for (int i = 0; i < 60; ++i) {
    const double length = nearest.norm();
    if (length < 1e-9) return 0;
    const Vector3 direction = -nearest / length;
    const Vector3 corner = support(direction);
    bound = std::max(bound, -corner.dot(direction));
    if (bound > 0.99 * length || simplex.size() > 3) break;
    simplex.push_back(corner);
    nearest = nearest_to_origin(simplex);
  }
  return bound;
}

inline double distance(const Solid& a, const Pose& pose_a, const Solid& b, const Pose& pose_b) {
  double least = infinity;
  for (const Part& one : a.parts) {
    for (const Part& other : b.parts)
      least =
          std::min(least, distance(one.core, pose_a * one.placement, other.core, pose_b * other.placement));
  }
  return least;
}

/// Returns the height of a solid above the plane through the origin with this unit normal.
inline double height_above(const Vector3& normal, const Solid& solid, const Pose& pose) {
  double least = infinity;
  for (const Part& part : solid.parts)
    least = std::min(least, normal.dot(part.core.support(pose * part.placement, -normal)));
  return least;
}

/// The pose and velocities of a body at the start, world.
struct Start {
  Pose pose;
  Vector3 velocity = Vector3::Zero();  ///< m/s
  Vector3 spin = Vector3::Zero();      ///< rad/s

  /// Returns the pose after `time` s of free motion of a body with equal principal moments.
  Pose at(double time) const {
    return {pose.position + time * velocity, rotation_quaternion(time * spin) * pose.orientation};
  }
};

/// The mass and material of a body.
struct Substance {
  double mass = 1;                         ///< kg
  Vector3 moments = Vector3::Constant(1);  ///< principal, kg m²
  double restitution = 0;
  double friction = 0;
};

inline void add_colliders(Scene& scene, int body, const Solid& solid, const Pose& pose,
                          const Substance& substance) {
  for (const Part& part : solid.parts) {
    Collider& collider = scene.colliders.emplace_back();
    collider.body = body;
    collider.shape = part.shape;
    collider.placement = pose * part.placement;
    collider.material.restitution = substance.restitution;
    collider.material.dynamic_friction = collider.material.static_friction = substance.friction;
  }
}

inline void add_static(Scene& scene, const Solid& solid, const Pose& pose, const Substance& substance) {
  add_colliders(scene, world_body, solid, pose, substance);
}

inline void add_static_plane(Scene& scene, const Pose& pose, const Substance& substance) {
  add_static(scene, {"plane", {{Plane{}, {}, {}}}}, pose, substance);
}

/// Adds a body; returns its index.
inline int add_body(Scene& scene, const Solid& solid, const Start& start, const Substance& substance) {
  const int index = add_body(scene, substance.mass, substance.moments, start.pose);
  Body& body = scene.bodies.back();
  body.name = fmt::format("{} {}", solid.name, index);
  body.linear_velocity = start.velocity;
  body.angular_velocity = start.spin;
  add_colliders(scene, index, solid, {}, substance);
  return index;
}

}  // namespace substep::test
