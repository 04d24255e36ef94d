#pragma once
// Solids of the tests of moving contacts.

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/time_of_impact.h"
#include "sim/geometry/triangle_mesh.h"
#include "tests/sim/random_trials.h"

namespace substep::test {

struct Part {
  Shape shape;
  Pose placement;
  Shape hull;  ///< the shape itself, or the hull of a mesh
};

/// Parts of a body, in its frame.
struct Solid {
  std::string name;
  std::vector<Part> parts;

  /// Returns a bound of the distance of its points from the origin.
  double reach() const {
    double largest = 0;
    for (const Part& part : parts) {
      const Bounds box = bounds(part.hull, part.placement);
      largest = std::max(largest, box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).norm());
    }
    return largest;
  }
};

inline Solid solid_of(const std::string& name, const Shape& shape) {
  return {name, {{shape, {}, shape}}};
}

inline Solid ball(double radius) {
  return solid_of("ball", Sphere{radius});
}

inline Solid capsule(double half_length, double radius) {
  return solid_of("capsule", Capsule{half_length, radius});
}

/// Returns a cylinder; with unequal radii a frustum or a cone.
inline Solid cylinder(double half_height, double radius_bottom, double radius_top) {
  return solid_of(radius_top > 0 ? "cylinder" : "cone", Cylinder{half_height, radius_bottom, radius_top});
}

/// Returns the half-space below y = 0, for static bodies.
inline Solid plane() {
  return solid_of("plane", Plane{});
}

inline std::vector<Vector3> box_corners(const Vector3& size) {
  std::vector<Vector3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back(0.5 * size.cwiseProduct(Vector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  return corners;
}

inline Solid box_of(const Vector3& size) {
  return solid_of("box", box(size));
}

/// Returns a box as a hull, which the solver does not know to be a box.
inline Solid box_hull(const Vector3& size) {
  return solid_of("hull", convex_hull(box_corners(size), "hull"));
}

/// Returns a closed mesh of a box, for static bodies.
inline Solid box_mesh(const Vector3& size) {
  const std::vector<Triangle> triangles{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                        {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return {"mesh", {{make_triangle_mesh(box_corners(size), triangles, "mesh"), {}, box(size)}}};
}

/// Returns a rectangle of two triangles in y = 0 that face up.
inline Solid rectangle_mesh(double size_x, double size_z) {
  return {"rectangle", {{make_rectangle(size_x, size_z, false), {}, box({size_x, 1e-5, size_z})}}};
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
      return solid_of("hull", convex_hull(points, "hull"));
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

/// Returns the distance of two solids, 0 where they meet. ContactOracle compares separation() with contacts.
inline double distance(const Solid& a, const Pose& pose_a, const Solid& b, const Pose& pose_b) {
  double least = infinity;
  for (const Part& one : a.parts) {
    for (const Part& other : b.parts) {
      const ConvexSolid solid(one.hull, pose_a * one.placement);
      least = std::min(least, separation(solid, {other.hull, pose_b * other.placement}, 1e-6).gap);
    }
  }
  return least;
}

/// Returns the height of a solid above the plane through the origin with this unit normal.
inline double height_above(const Vector3& normal, const Solid& solid, const Pose& pose) {
  double least = infinity;
  for (const Part& part : solid.parts) {
    const ConvexSolid convex(part.hull, pose * part.placement);
    least = std::min(least, normal.dot(convex.support(-normal)) - convex.radius());
  }
  return least;
}

struct Start {
  Pose pose;
  Vector3 velocity = Vector3::Zero();
  Vector3 spin = Vector3::Zero();

  /// Returns the pose at a time of a body without forces whose moments are equal.
  Pose at(double time) const {
    return {pose.position + time * velocity, rotation_quaternion(time * spin) * pose.orientation};
  }
};

struct Substance {
  double mass = 1;
  Vector3 moments = Vector3::Constant(1);  ///< principal
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

/// Adds a body; returns its index.
inline int add_body(Scene& scene, const Solid& solid, const Start& start, const Substance& substance) {
  const int index = static_cast<int>(scene.bodies.size());
  Body& body = scene.bodies.emplace_back();
  body.name = fmt::format("{} {}", solid.name, index);
  body.inverse_mass = 1 / substance.mass;
  body.inverse_inertia = substance.moments.cwiseInverse();
  body.pose = start.pose;
  body.linear_velocity = start.velocity;
  body.angular_velocity = start.spin;
  add_colliders(scene, index, solid, {}, substance);
  return index;
}

/// Returns the principal moments of a uniform box.
inline Vector3 box_moments(double mass, const Vector3& size) {
  const Vector3 s = size.cwiseAbs2();
  return mass / 12 * Vector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
}

inline Vector3 ball_moments(double mass, double radius) {
  return Vector3::Constant(0.4 * mass * radius * radius);
}

}  // namespace substep::test
