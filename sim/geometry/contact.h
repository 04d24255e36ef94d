#pragma once
/// Contacts between shapes: stateless separating-axis tests and clipping. Report, step s1: run once per step
/// `h`.

#include <cstdint>
#include <utility>
#include <vector>

#include "sim/geometry/shape.h"

namespace substep {

/// One contact point of a pair of shapes (a, b), in the world frame.
struct ContactPoint {
  Vector3 on_a;     ///< point fixed on a
  Vector3 on_b;     ///< point fixed on b
  Vector3 normal;   ///< unit, from b to a
  double distance;  ///< (on_a − on_b) · normal; negative where the shapes overlap
};

using Contacts = std::vector<ContactPoint>;

/// Finds all contact points of two shapes closer than `margin` (metres), the whole manifold: for two faces
/// the corners of their intersection, for a lying capsule two points. Between two boxes it leaves out corners
/// beyond four that lie within 1e-3 of the smaller box's size of the line through their neighbours. Depends
/// on its arguments alone, not on any earlier call, and contacts(b, a) are contacts(a, b) mirrored. Appends
/// to `out`, which it never clears; does not allocate once `out` and the thread's scratch are large enough.
///
/// Polytopes: the faces of a, the faces of b and those cross products of their edges that can bound the
/// overlap are tested. A face axis is preferred to an edge axis unless the latter is better by 0.05
/// |separation| + 1e-3 of the smaller shape's size (the diameter of its bounding ball), so that a slight tilt
/// does not shrink a face contact to a point. Convex shapes that overlap have at least one contact.
///
/// Cylinders are round: standing, they touch with 8 points of the rim, one of them its lowest, or lying at
/// the shape's own X where it stands straight to 1e-5; lying, with 2 on the line of their side; else with
/// one. Where a disc is partly over a face, corners of the face and crossings of the outlines take the place
/// of the rim points beside it.
///
/// A triangle mesh pushes along directions in which, judged by a triangle's neighbours, the surface has
/// nothing farther out: the normals of its faces and the directions round its convex edges and corners, never
/// those of edges in a plane or a valley. A one-sided mesh's triangle does nothing to a shape whose middle is
/// behind it. Contacts with triangles of one plane are the corners of their hull.
void find_contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double margin,
                   Contacts& out);

/// Returns the axis-aligned box around a shape. It is tight up to rounding, but for a triangle mesh it is the
/// box around the mesh's own turned box, and for a plane it is infinite except along an axis that the plane
/// is normal to.
Bounds bounds(const Shape& shape, const Pose& pose);

/// Finds the boxes that overlap: a sweep along the axis of largest spread, with the boxes it passes kept in
/// lanes along the other two. Sweeps over enlarged boxes, and keeps their pairs until a box leaves its own.
class BroadPhase {
 public:
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  /// Sets `pairs` to the pairs (i, j), i < j, of boxes that overlap, in ascending order. They depend on the
  /// boxes alone; the members are memory kept between calls. A box with NaN is in no pair.
  void find_pairs(const std::vector<Bounds>& boxes, Pairs& pairs);

  /// Returns the number of pairs that the last call's sweep tested, the same on every machine.
  std::uint64_t pairs_tested() const { return pairs_tested_; }

 private:
  void sweep(const std::vector<Bounds>& boxes, Pairs& pairs);
  void sort_pairs(std::uint32_t count, Pairs& pairs);
  struct Entry {
    double lower;
    std::uint32_t box;
  };
  void sort_along(int axis, const std::vector<Bounds>& boxes);

  std::vector<Bounds> enlarged_;
  Pairs near_;  ///< of enlarged boxes
  std::vector<Entry> order_;
  std::vector<double> widths_;
  std::vector<std::uint32_t> heads_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> begins_;
  std::vector<std::uint32_t> seconds_;
  std::uint64_t pairs_tested_ = 0;
};

}  // namespace substep
