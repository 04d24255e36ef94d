// Finds contacts of two boxes, the most frequent pair in piles.

#include <algorithm>
#include <cmath>

#include "sim/geometry/contact_pairs.h"
#include "sim/geometry/features.h"

namespace substep {
namespace {

/// Corners beyond four are removed where they are nearer than this fraction of the size to the line through
/// their neighbours: faces that are slightly turned cut each other's corners.
constexpr double slight_cut = 1e-3;

struct WorldBox {
  Vector3 centre;
  Matrix3 axes;  ///< columns; box → world
  Vector3 half_size;
};

/// The placement of one box in the frame of the other.
struct Relative {
  Matrix3 axes;
  Vector3 centre;
};

/// The incident face seen from the reference face: each corner's position in the plane (x, y) and height
/// above it (z). It has four corners, and one more for each cut by a side.
thread_local CutPolygon box_face(8);

/// Removes corners, the nearest to the line through their neighbours first, while there are more than four
/// and the distance from the line is at most `distance`.
void simplify(std::vector<Vector3>& corners, double distance) {
  while (corners.size() > 4) {
    std::size_t nearest = corners.size();
    double least = distance * distance;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vector3& from = corners[i > 0 ? i - 1 : corners.size() - 1];
      const Vector3& to = corners[i + 1 < corners.size() ? i + 1 : 0];
      const double along_x = to.x() - from.x();
      const double along_y = to.y() - from.y();
      const double area = along_x * (corners[i].y() - from.y()) - along_y * (corners[i].x() - from.x());
      const double length_squared = along_x * along_x + along_y * along_y;
      if (area * area > least * length_squared || length_squared == 0) continue;
      nearest = i;
      least = area * area / length_squared;
    }
    if (nearest == corners.size()) return;
    corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(nearest));
  }
}

/// The axis across an edge of each box, and the separation along it, m. Edges are named by their box axis.
struct BoxEdgeAxis {
  double separation = -infinity;
  int of_a = 0;
  int of_b = 0;
};

class BoxPair {
 public:
  BoxPair(const WorldBox& a, const WorldBox& b, double size, double margin, Contacts& out)
      : a_(a), b_(b), size_(size), margin_(margin), out_(out) {
    const Vector3 between = b.centre - a.centre;
    b_in_a_ = {a.axes.transpose() * b.axes, a.axes.transpose() * between};
    a_in_b_ = {b_in_a_.axes.transpose(), -(b.axes.transpose() * between)};
    absolute_ = b_in_a_.axes.cwiseAbs();
  }

  /// Tests the 15 axes. Returns false where one of them shows a gap of the margin or more.
  bool are_within_margin() {
    for (std::uint32_t i = 0; i < 3; ++i) {
      const double reach = a_.half_size[i] + absolute_.row(i).dot(b_.half_size);
      const double separation = std::abs(b_in_a_.centre[i]) - reach;
      if (separation > face_a_.separation) face_a_ = {separation, i};
    }
    if (face_a_.separation >= margin_) return false;
    for (std::uint32_t j = 0; j < 3; ++j) {
      const double reach = b_.half_size[j] + absolute_.col(j).dot(a_.half_size);
      const double separation = std::abs(a_in_b_.centre[j]) - reach;
      if (separation > face_b_.separation) face_b_ = {separation, j};
    }
    if (face_b_.separation >= margin_) return false;
    // Test the edges, which count where they separate the boxes more than the faces do.
    edge_.separation = std::max(face_a_.separation, face_b_.separation);
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3;
      const int i2 = (i + 2) % 3;
      for (int j = 0; j < 3; ++j) {
        const int j1 = (j + 1) % 3;
        const int j2 = (j + 2) % 3;
        const Matrix3& r = b_in_a_.axes;
        const double squared = r(i1, j) * r(i1, j) + r(i2, j) * r(i2, j);
        if (squared < 1e-12) continue;  // parallel edges: the faces' axes are enough
        const double centre = std::abs(b_in_a_.centre[i2] * r(i1, j) - b_in_a_.centre[i1] * r(i2, j));
        const double reach = a_.half_size[i1] * absolute_(i2, j) + a_.half_size[i2] * absolute_(i1, j) +
                             b_.half_size[j1] * absolute_(i, j2) + b_.half_size[j2] * absolute_(i, j1);
        // Take the root only where it can matter.
        const double scaled = centre - reach;
        if (scaled < 0 && scaled * scaled >= edge_.separation * edge_.separation * squared &&
            edge_.separation <= 0) {
          continue;
        }
        const double separation = scaled / std::sqrt(squared);
        if (separation >= margin_) return false;
        if (separation > edge_.separation) edge_ = {separation, i, j};
      }
    }
    return true;
  }

  /// Adds the contacts along the preferred axis. Returns false where the boxes are apart and this axis has
  /// none; then the closest features along `axis()` must be searched for.
  bool add_contacts() {
    const double face = std::max(face_a_.separation, face_b_.separation);
    const bool second =
        face_b_.separation > face_a_.separation + second_face_preference(face_a_.separation, size_);
    if (edge_.separation > face + face_preference(face, size_)) return add_edge_contact();
    if (add_face_contacts(second, false)) return true;
    // The preferred axis has no contact, so the axis of the largest separation decides.
    if (separation() > 0) return false;
    if (edge_.separation > face) return add_edge_contact();
    return add_face_contacts(face_b_.separation > face_a_.separation, true);
  }

  double separation() const { return std::max({face_a_.separation, face_b_.separation, edge_.separation}); }

  /// Returns the axis of the largest separation, in the world, from a to b.
  Vector3 axis() const {
    const double largest = separation();
    Vector3 axis;
    if (face_a_.separation == largest) {
      axis = a_.axes.col(face_a_.face);
    } else if (face_b_.separation == largest) {
      axis = b_.axes.col(face_b_.face);
    } else {
      axis = a_.axes.col(edge_.of_a).cross(b_.axes.col(edge_.of_b)).normalized();
    }
    return axis.dot(b_.centre - a_.centre) < 0 ? Vector3(-axis) : axis;
  }

 private:
  /// Loads box_face with the face of `incident` most opposed to the reference face at side * plane along
  /// `axis`.
  static void load_box_face(const WorldBox& incident, const Relative& relative, std::uint32_t axis,
                            double side, double plane) {
    int facing = 0;
    relative.axes.row(axis).cwiseAbs().maxCoeff(&facing);
    const double facing_side = side * relative.axes(axis, facing) > 0 ? -1 : 1;
    const Vector3 middle =
        relative.centre + facing_side * incident.half_size[facing] * relative.axes.col(facing);
    const int first = (facing + 1) % 3;
    const int second = (facing + 2) % 3;
    const Vector3 u = incident.half_size[first] * relative.axes.col(first);
    const Vector3 v = incident.half_size[second] * relative.axes.col(second);
    box_face.clear();
    for (const auto& [su, sv] : {std::pair{1.0, 1.0}, {-1.0, 1.0}, {-1.0, -1.0}, {1.0, -1.0}}) {
      const Vector3 point = middle + su * u + sv * v;
      box_face.corners.emplace_back(point[(axis + 1) % 3], point[(axis + 2) % 3], side * point[axis] - plane);
    }
  }

  /// Clips the incident face by the sides of the reference face. Returns false where that removes the lowest
  /// point; with `by_force` the lowest corner is then the contact, since only rounding removes it.
  bool add_face_contacts(bool reference_is_b, bool by_force) {
    const WorldBox& reference = reference_is_b ? b_ : a_;
    const Relative& relative = reference_is_b ? a_in_b_ : b_in_a_;
    const auto& [separation, axis] = reference_is_b ? face_b_ : face_a_;
    const std::uint32_t x = (axis + 1) % 3;
    const std::uint32_t y = (axis + 2) % 3;
    const double side = relative.centre[axis] < 0 ? -1 : 1;
    const double plane = reference.half_size[axis];
    load_box_face(reference_is_b ? a_ : b_, relative, axis, side, plane);
    std::vector<Vector3>& corners = box_face.corners;
    const auto height_of = [](const Vector3& corner) { return corner.z(); };
    const Vector3 lowest = *std::ranges::min_element(corners, {}, height_of);
    const double tolerance = flush_fraction * size_;
    for (const double sign : {1.0, -1.0}) {
      box_face.cut(tolerance,
                   [&](const Vector3& corner) { return sign * corner.x() - reference.half_size[x]; });
    }
    for (const double sign : {1.0, -1.0}) {
      box_face.cut(tolerance,
                   [&](const Vector3& corner) { return sign * corner.y() - reference.half_size[y]; });
    }

    double least = infinity;
    for (const Vector3& corner : corners) least = std::min(least, corner.z());
    // Reject the face where the lowest point is cut away: the two do not meet there.
    if (least >= margin_ || least > separation + face_preference(separation, size_)) {
      if (!by_force) return false;
      corners.assign(1, lowest);
    }

    simplify(corners, slight_cut * size_);
    const Vector3 outward = side * reference.axes.col(axis);
    const Vector3 normal = reference_is_b ? outward : Vector3(-outward);
    for (const Vector3& corner : corners) {
      const double height = corner.z();
      if (height >= margin_) continue;
      Vector3 local;
      local[x] = corner.x();
      local[y] = corner.y();
      local[axis] = side * plane;
      const Vector3 on_reference = reference.axes * local + reference.centre;
      const Vector3 on_incident = on_reference + height * outward;
      out_.push_back({reference_is_b ? on_incident : on_reference,
                      reference_is_b ? on_reference : on_incident, normal, height});
    }
    return true;
  }

  bool add_edge_contact() {
    Vector3 axis = a_.axes.col(edge_.of_a).cross(b_.axes.col(edge_.of_b)).normalized();
    if (axis.dot(b_.centre - a_.centre) < 0) axis = -axis;
    ClosestPair closest;
    closest.consider(outermost_edge(a_, edge_.of_a, axis), outermost_edge(b_, edge_.of_b, -axis));
    const Vector3 between = closest.on_b - closest.on_a;
    // Reject edges with a gap that do not cross: they are not the closest features.
    if (edge_.separation > 0 && (between - edge_.separation * axis).norm() > 1e-6 * size_) return false;
    out_.push_back({closest.on_a, closest.on_b, -axis, between.dot(axis)});
    return true;
  }

  static Segment outermost_edge(const WorldBox& box, int along, const Vector3& direction) {
    Vector3 middle = box.centre;
    for (const int k : {(along + 1) % 3, (along + 2) % 3}) {
      const Vector3 half = box.half_size[k] * box.axes.col(k);
      middle += half.dot(direction) > 0 ? half : Vector3(-half);
    }
    const Vector3 half = box.half_size[along] * box.axes.col(along);
    return {middle - half, middle + half};
  }

  const WorldBox& a_;
  const WorldBox& b_;
  double size_;
  double margin_;
  Contacts& out_;
  Relative b_in_a_;
  Relative a_in_b_;
  Matrix3 absolute_;  ///< |b_in_a_.axes|
  FaceAxis face_a_;
  FaceAxis face_b_;
  BoxEdgeAxis edge_;
};

}  // namespace

void find_box_box(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b, double margin,
                  Contacts& out) {
  const double reach = a.bounding_radius + b.bounding_radius + margin;
  if ((pose_a.position - pose_b.position).squaredNorm() >= reach * reach) return;
  const WorldBox box_a = {pose_a.position, pose_a.orientation.toRotationMatrix(), *a.half_box};
  const WorldBox box_b = {pose_b.position, pose_b.orientation.toRotationMatrix(), *b.half_box};
  const double size = 2 * std::min(a.bounding_radius, b.bounding_radius);
  BoxPair pair(box_a, box_b, size, margin, out);
  if (!pair.are_within_margin() || pair.add_contacts()) return;
  find_closest_features(a, pose_a, b, pose_b, pair.axis(), pair.separation(), margin, out);
}

}  // namespace substep
