// Contacts of two convex polytopes: separating axes, then the clipped face or the crossing edges. One file,
// since the search for axes, clipping and closest features share placements and memory.
//
// The search works in the frame of one of the two, so that the digits do not depend on the distance of the
// pair from the origin.

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/geometry/contact_pairs.h"
#include "sim/geometry/features.h"

namespace substep {
namespace {

/// The pose of a polytope in the frame of another.
struct Placement {
  Matrix3 rotation;
  Vector3 position;

  Vector3 point(const Vector3& inner) const { return rotation * inner + position; }
  Segment segment(const Segment& inner) const { return {point(inner.from), point(inner.to)}; }
};

Placement relative(const Pose& outer, const Pose& inner) {
  const Quaternion back = outer.orientation.conjugate();
  return {(back * inner.orientation).toRotationMatrix(), back * (inner.position - outer.position)};
}

/// The results of the search over the faces of one polytope, for each face.
struct FaceKnowledge {
  double height;          ///< of the other's centre above the face
  std::uint32_t witness;  ///< the other's vertex lowest over the face, where that was looked for
};

/// An edge that may touch the other polytope, in the frame of a. The normals of b's are negative.
struct EdgeCandidate : PolytopeEdge {
  std::uint32_t edge;
};

/// Scratch memory that all pairs share.
struct PolytopeMemory {
  static constexpr std::size_t edges_of_box = 12;
  std::vector<FaceKnowledge> faces_a;
  std::vector<FaceKnowledge> faces_b;
  std::vector<EdgeCandidate> edges_a;
  std::vector<EdgeCandidate> edges_b;
  CutPolygon incident{edges_of_box};

  /// Reserves memory for boxes: those that lie flat in the first step may need their edges later.
  PolytopeMemory() {
    edges_a.reserve(edges_of_box);
    edges_b.reserve(edges_of_box);
  }
};

thread_local PolytopeMemory memory;

struct PolytopeEdgeAxis {
  double separation = -infinity;
  Vector3 axis = Vector3::Zero();  ///< unit, from a to b, frame of a
  std::uint32_t of_a = 0;
  std::uint32_t of_b = 0;
};

/// Returns the largest n · x over unit vectors n between n1 and n2, for an x with n1 · x = h1 and n2 · x =
/// h2.
double largest_between(double h1, double h2, double cosine) {
  const double squared_sine = 1 - cosine * cosine;
  if (squared_sine < 1e-12 || h1 < cosine * h2 || h2 < cosine * h1) return std::max(h1, h2);
  return std::sqrt(std::max(0.0, (h1 * h1 + h2 * h2 - 2 * cosine * h1 * h2) / squared_sine));
}

double lowest(const Polytope& polytope, const Vector3& direction) {
  return -farthest(polytope.vertices, -direction).height;
}

/// Returns the face of p with the largest separation of q, given in p's frame. Stops early at `margin`.
FaceAxis search_faces(const Polytope& p, const Polytope& q, const Placement& q_in_p, double margin,
                      std::vector<FaceKnowledge>& faces) {
  const Vector3 centre = q_in_p.point(q.centre);
  faces.resize(p.face_count());
  std::uint32_t highest = 0;
  for (std::uint32_t f = 0; f < p.face_count(); ++f) {
    faces[f] = {p.face_normals[f].dot(centre) - p.face_offsets[f], no_index};
    if (faces[f].height > faces[highest].height) highest = f;
  }
  FaceAxis best;
  const auto measure = [&](std::uint32_t f) {
    const Vector3& normal = p.face_normals[f];
    const double base = normal.dot(q_in_p.position) - p.face_offsets[f];
    const Extent below = farthest(q.vertices, -(q_in_p.rotation.transpose() * normal));
    faces[f].witness = below.vertex;
    const double separation = base - below.height;
    if (separation > best.separation) best = {separation, f};
  };
  measure(highest);
  for (std::uint32_t f = 0; f < p.face_count() && best.separation < margin; ++f) {
    // q reaches at least as far down as the ball that it holds.
    if (f != highest && faces[f].height - q.inner_radius > best.separation) measure(f);
  }
  return best;
}

/// Calls `use(edge)` for the edges of p one of whose axes may separate the two by more than `threshold`.
template <class Use>
void for_each_candidate(const Polytope& p, const Polytope& q, const Placement& q_in_p,
                        const std::vector<FaceKnowledge>& faces, double threshold, Use use) {
  for (std::uint32_t e = 0; e < p.edges.size(); ++e) {
    const std::uint32_t f = p.edge_faces[e][0];
    const std::uint32_t g = p.edge_faces[e][1];
    const Vector3& n = p.face_normals[f];
    const Vector3& m = p.face_normals[g];
    const double cosine = n.dot(m);
    // Along each axis between the two faces' normals, q reaches at least as far down as its inner ball …
    if (largest_between(faces[f].height, faces[g].height, cosine) - q.inner_radius <= threshold) continue;
    // … and as its vertices that are lowest over the two faces.
    const auto is_below = [&](std::uint32_t witness) {
      if (witness == no_index) return false;
      const Vector3 vertex = q_in_p.point(q.vertices[witness]);
      return largest_between(n.dot(vertex) - p.face_offsets[f], m.dot(vertex) - p.face_offsets[g], cosine) <=
             threshold;
    };
    if (is_below(faces[f].witness) || is_below(faces[g].witness)) continue;
    use(e);
  }
}

/// The search for the axis of contact of two polytopes, and the contacts along it.
class PolytopePair {
 public:
  PolytopePair(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b, double margin,
               Contacts& out)
      : a_(a), b_(b), pose_a_(pose_a), pose_b_(pose_b), margin_(margin), out_(out) {}

  void find() {
    face_a_ = search_faces(a_, b_, b_in_a_, margin_, memory.faces_a);
    if (face_a_.separation >= margin_) return;
    face_b_ = search_faces(b_, a_, a_in_b_, margin_, memory.faces_b);
    if (face_b_.separation >= margin_) return;
    const double face = std::max(face_a_.separation, face_b_.separation);
    search_edges(face + face_preference(face, size_));
    if (edge_.separation >= margin_) return;
    if (edge_.separation > -infinity) {
      if (!add_edge_contact()) add_closest();
      return;
    }
    const bool second =
        face_b_.separation > face_a_.separation + second_face_preference(face_a_.separation, size_);
    if (add_face_contacts(second, false)) return;
    // The preferred axis has no contact, so the axis of the largest separation decides.
    search_edges(face);
    if (edge_.separation >= margin_) return;
    if (std::max(face, edge_.separation) > 0) {
      if (edge_.separation <= face || !add_edge_contact()) add_closest();
    } else if (edge_.separation > face) {
      add_edge_contact();
    } else {
      add_face_contacts(face_b_.separation > face_a_.separation, true);
    }
  }

 private:
  /// Finds the axis of two edges with the largest separation above `threshold`.
  void search_edges(double threshold) {
    memory.edges_a.clear();
    memory.edges_b.clear();
    const auto add = [](std::vector<EdgeCandidate>& edges, std::uint32_t edge, const Segment& ends,
                        const Vector3& n, const Vector3& m) {
      edges.push_back({{ends.from, ends.to - ends.from, {n, m}, n.cross(m)}, edge});
    };
    for_each_candidate(a_, b_, b_in_a_, memory.faces_a, threshold, [&](std::uint32_t e) {
      const auto& [f, g] = a_.edge_faces[e];
      add(memory.edges_a, e, edge_of(a_, e), a_.face_normals[f], a_.face_normals[g]);
    });
    if (memory.edges_a.empty()) return;
    for_each_candidate(b_, a_, a_in_b_, memory.faces_b, threshold, [&](std::uint32_t e) {
      const auto& [f, g] = b_.edge_faces[e];
      add(memory.edges_b, e, b_in_a_.segment(edge_of(b_, e)), -(b_in_a_.rotation * b_.face_normals[f]),
          -(b_in_a_.rotation * b_.face_normals[g]));
    });
    double best = threshold;
    for (const EdgeCandidate& ea : memory.edges_a) {
      for (const EdgeCandidate& eb : memory.edges_b) {
        Vector3 axis;
        if (!cross_edges(ea, eb, axis)) continue;
        if (axis.dot(eb.from - ea.from) <= best) continue;
        // Where arcs nearly touch, rounding may have let a wrong pair through: the true extents decide.
        const double separation =
            lowest(a_, -axis) + axis.dot(b_in_a_.position) + lowest(b_, b_in_a_.rotation.transpose() * axis);
        if (separation <= best) continue;
        best = separation;
        edge_ = {separation, axis, ea.edge, eb.edge};
        if (separation >= margin_) return;
      }
    }
  }

  void add_closest() {
    // Choose the axis of the largest separation, in the world, from a to b.
    const double separation = std::max({face_a_.separation, face_b_.separation, edge_.separation});
    Vector3 axis = pose_a_.orientation * edge_.axis;
    if (separation == face_a_.separation) {
      axis = pose_a_.orientation * a_.face_normals[face_a_.face];
    } else if (separation == face_b_.separation) {
      axis = -(pose_b_.orientation * b_.face_normals[face_b_.face]);
    }
    find_closest_features(a_, pose_a_, b_, pose_b_, axis, separation, margin_, out_);
  }

  /// Adds the contact of the two edges. Returns false where they are separate and do not cross, so that other
  /// features are closer.
  bool add_edge_contact() {
    ClosestPair closest;
    closest.consider(edge_of(a_, edge_.of_a), b_in_a_.segment(edge_of(b_, edge_.of_b)));
    const Vector3 between = closest.on_b - closest.on_a;
    const double distance = between.dot(edge_.axis);
    if (edge_.separation > 0 && (between - distance * edge_.axis).norm() > 1e-6 * size_) return false;
    out_.push_back(
        {pose_a_ * closest.on_a, pose_a_ * closest.on_b, -(pose_a_.orientation * edge_.axis), distance});
    return true;
  }

  /// Clips a face of the other polytope by the sides of the reference face. `by_force` takes its lowest
  /// corner if nothing remains, which only rounding can bring about.
  bool add_face_contacts(bool reference_is_b, bool by_force) {
    const Polytope& p = reference_is_b ? b_ : a_;
    const Polytope& q = reference_is_b ? a_ : b_;
    const Placement& q_in_p = reference_is_b ? a_in_b_ : b_in_a_;
    const std::uint32_t face = (reference_is_b ? face_b_ : face_a_).face;
    const Vector3& normal = p.face_normals[face];
    const double offset = p.face_offsets[face];
    const double tolerance = flush_fraction * size_;

    load_incident_face(q, q_in_p, normal, tolerance);
    Vector3 lowest_corner = memory.incident.corners[0];
    for (const Vector3& corner : memory.incident.corners) {
      if (normal.dot(corner) < normal.dot(lowest_corner)) lowest_corner = corner;
    }
    for_each_side(p, face, [&](const Vector3& corner, const Vector3& outward) {
      const Vector3 unit = outward.normalized();
      memory.incident.cut(tolerance, [&](const Vector3& point) { return unit.dot(point - corner); });
    });

    double least = infinity;
    for (const Vector3& corner : memory.incident.corners)
      least = std::min(least, normal.dot(corner) - offset);
    // Where the lowest point is cut away, this is not the face at which the two meet.
    const double separation = (reference_is_b ? face_b_ : face_a_).separation;
    if (least >= margin_ || least > separation + face_preference(separation, size_)) {
      if (!by_force) return false;
      memory.incident.corners.assign(1, lowest_corner);
    }
    const Pose& pose = reference_is_b ? pose_b_ : pose_a_;
    const Vector3 outward = pose.orientation * normal;
    for (const Vector3& corner : memory.incident.corners) {
      const double height = normal.dot(corner) - offset;
      if (height >= margin_) continue;
      const Vector3 on_incident = pose * corner;
      const Vector3 on_reference = on_incident - height * outward;
      out_.push_back(reference_is_b ? ContactPoint{on_incident, on_reference, outward, height}
                                    : ContactPoint{on_reference, on_incident, -outward, height});
    }
    return true;
  }

  /// Puts into memory.incident the face of q that looks most against `normal` among those that have q's
  /// lowest vertex, in the frame of p.
  void load_incident_face(const Polytope& q, const Placement& q_in_p, const Vector3& normal,
                          double tolerance) {
    const Vector3 direction = q_in_p.rotation.transpose() * normal;
    const double least = lowest(q, direction) + tolerance;
    double most_against = infinity;
    std::uint32_t incident = 0;
    for (std::uint32_t f = 0; f < q.face_count(); ++f) {
      const double facing = direction.dot(q.face_normals[f]);
      if (facing >= most_against) continue;
      for (std::uint32_t i = q.face_begin[f]; i < q.face_begin[f + 1]; ++i) {
        if (direction.dot(q.vertices[q.face_vertices[i]]) > least) continue;
        most_against = facing;
        incident = f;
        break;
      }
    }
    memory.incident.clear();
    for (std::uint32_t i = q.face_begin[incident]; i < q.face_begin[incident + 1]; ++i) {
      memory.incident.corners.push_back(q_in_p.point(q.vertices[q.face_vertices[i]]));
    }
  }

  const Polytope& a_;
  const Polytope& b_;
  const Pose& pose_a_;
  const Pose& pose_b_;
  Placement b_in_a_ = relative(pose_a_, pose_b_);
  Placement a_in_b_ = relative(pose_b_, pose_a_);
  double size_ = 2 * std::min(a_.bounding_radius, b_.bounding_radius);
  double margin_;
  Contacts& out_;
  FaceAxis face_a_;
  FaceAxis face_b_;
  PolytopeEdgeAxis edge_;
};

/// The vertices and edges of a placed polytope that reach into the slab before a plane.
class Slab {
 public:
  Slab(const Polytope& polytope, const Placement& placement, const Vector3& axis, double depth)
      : polytope_(polytope),
        placement_(placement),
        direction_(placement.rotation.transpose() * axis),
        limit_(lowest(polytope, direction_) + depth) {}

  bool has(std::uint32_t vertex) const { return direction_.dot(polytope_.vertices[vertex]) <= limit_; }

  template <class Use>
  void for_each_edge(Use use) const {
    for (std::uint32_t e = 0; e < polytope_.edges.size(); ++e) {
      if (!has(polytope_.edges[e][0]) && !has(polytope_.edges[e][1])) continue;
      use(placement_.segment(edge_of(polytope_, e)));
    }
  }

  /// Calls `use(vertex, foot)` for each vertex of this slab and each face of `other` above which it lies; the
  /// foot is its projection.
  template <class Use>
  void for_each_vertex_over(const Slab& other, Use use) const {
    for (std::uint32_t v = 0; v < polytope_.vertices.size(); ++v) {
      if (!has(v)) continue;
      const Vector3 vertex = placement_.point(polytope_.vertices[v]);
      const Vector3 local = other.placement_.rotation.transpose() * (vertex - other.placement_.position);
      for (std::size_t f = 0; f < other.polytope_.face_count(); ++f) {
        const Vector3& normal = other.polytope_.face_normals[f];
        const double height = normal.dot(local) - other.polytope_.face_offsets[f];
        if (height < 0 || !is_over(other.polytope_, f, local)) continue;
        use(vertex, other.placement_.point(local - height * normal));
      }
    }
  }

 private:
  const Polytope& polytope_;
  const Placement& placement_;
  Vector3 direction_;
  double limit_;
};

}  // namespace

void find_polytope_polytope(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                            double margin, Contacts& out) {
  const double reach = a.bounding_radius + b.bounding_radius + margin;
  const Vector3 between =
      pose_a.position - pose_b.position + pose_a.orientation * a.centre - pose_b.orientation * b.centre;
  if (between.squaredNorm() >= reach * reach) return;
  PolytopePair(a, pose_a, b, pose_b, margin, out).find();
}

void find_closest_features(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                           const Vector3& axis, double separation, double margin, Contacts& out) {
  // Points nearer to each other than the margin are at most this deep behind the two planes that bound the
  // gap.
  const double depth = margin - separation;
  const Vector3 local_axis = pose_a.orientation.conjugate() * axis;
  const Placement a_in_a = {Matrix3::Identity(), Vector3::Zero()};
  const Placement b_in_a = relative(pose_a, pose_b);
  const Slab slab_a(a, a_in_a, -local_axis, depth);
  const Slab slab_b(b, b_in_a, local_axis, depth);

  ClosestPair closest = {.squared_distance = margin * margin};
  slab_a.for_each_vertex_over(
      slab_b, [&](const Vector3& of_a, const Vector3& of_b) { closest.consider(of_a, of_b); });
  slab_b.for_each_vertex_over(
      slab_a, [&](const Vector3& of_b, const Vector3& of_a) { closest.consider(of_a, of_b); });
  slab_a.for_each_edge([&](const Segment& of_a) {
    slab_b.for_each_edge([&](const Segment& of_b) { closest.consider(of_a, of_b); });
  });
  if (closest.squared_distance == margin * margin) return;
  const Vector3 between = closest.on_a - closest.on_b;
  const double distance = between.norm();
  const double size = std::min(a.bounding_radius, b.bounding_radius);
  // Coincident points give no direction.
  const Vector3 normal =
      distance > flush_fraction * size ? Vector3(between / distance) : Vector3(-local_axis);
  out.push_back(
      {pose_a * closest.on_a, pose_a * closest.on_b, pose_a.orientation * normal, normal.dot(between)});
}

}  // namespace substep
