#include "sim/geometry/contact_facets.h"

#include <algorithm>
#include <cmath>

#include "sim/geometry/contact_pairs.h"

namespace substep {
namespace {

/// Neighbours that rise above a direction's plane by no more than this slope do not forbid it: vertices
/// stored in single precision are off by as much.
constexpr double level = 1e-6;

thread_local std::vector<Vector3> polygon_corners;

/// Returns the unit vector at a fraction of the chord from one unit vector to another.
Vector3 between(const Vector3& first, const Vector3& last, double fraction) {
  return ((1 - fraction) * first + fraction * last).normalized();
}

/// The search for the axis of contact of a revolved solid a and facets b, and the contacts along it.
class RevolvedSearch {
 public:
  RevolvedSearch(const RevolvedSolid& a, const Facets& b, double margin, Contacts& out)
      : a_(a), b_(b), size_(std::min(2 * a.reach(), b.size)), margin_(margin), out_(out) {}

  void find() {
    // Take the face of b that separates most.
    for (std::uint32_t f = 0; f < b_.face_normals.size(); ++f) {
      const Vector3& n = b_.face_normals[f];
      const double separation = -a_.height(-n) - b_.face_offsets[f];
      if (separation >= margin_) return;
      if (separation > face_.separation) face_ = {{separation, n}, true, f};
    }
    // Try a's discs, the neighbours' normals, the arcs of b's edges, and the directions to b's vertices.
    if (!a_.is_ball_ended && !search_discs()) return;
    for (const Vector3& n : b_.around) {
      if (!consider(n, no_index, true)) return;
    }
    for (std::uint32_t i = 0; i < b_.arcs.size(); ++i) {
      if (!search_arc(i)) return;
    }
    for (std::uint32_t v = 0; v < b_.vertices.size(); ++v) {
      const std::optional<Vector3> direction = a_.direction_to(b_.vertices[v]);
      if (direction && !consider(-*direction, no_index, false)) return;
    }
    add_contacts();
  }

 private:
  double preference(double separation) const { return face_preference(separation, size_); }

  /// Keeps a direction if it separates the two most. Returns false where it separates them by the margin.
  bool consider(const Vector3& n, std::uint32_t arc, bool of_neighbour) {
    const Extent of_b = b_.extent(n);
    const double separation = -a_.height(-n) - of_b.height;
    if (separation <= edge_.separation) return true;
    // Directions of arcs and neighbours need no test; others count where the facets push along them.
    if (arc == no_index && !of_neighbour && !b_.pushes(n, of_b.vertex)) return true;
    edge_ = {{separation, n}, arc, of_neighbour};
    return separation < margin_;
  }

  /// Searches the discs' normals. Returns false where one separates the two by the margin.
  bool search_discs() {
    for (std::uint32_t end = 0; end < 2; ++end) {
      if (a_.radius[end] == 0) continue;
      const Vector3 n = end == 0 ? a_.axis : Vector3(-a_.axis);
      const Extent of_b = b_.extent(n);
      const double separation = -a_.height(-n) - of_b.height;
      if (!b_.pushes(n, of_b.vertex)) continue;
      if (separation >= margin_) return false;
      // Prefer a face of b.
      const double handicap = face_.of_b ? second_face_preference(face_.separation, size_) : 0;
      if (separation > face_.separation + handicap) face_ = {{separation, n}, false, end};
    }
    return true;
  }

  /// Searches an edge's arc for the best direction.
  bool search_arc(std::uint32_t i) {
    if (!a_.has_side || a_.sine == 0) return search_split(i, 0, 1);
    // Split the arc at the direction closest to the axis: on each side of it the arc can cross the directions
    // of the slanting side once.
    const Facets::Arc& arc = b_.arcs[i];
    const double cosine = arc.first.dot(arc.last);
    const double along_first = a_.axis.dot(arc.first);
    const double along_last = a_.axis.dot(arc.last);
    const double of_first = along_first - cosine * along_last;
    const double of_last = along_last - cosine * along_first;
    if (of_first * of_last <= 0) return search_split(i, 0, 1);
    const double most = of_last / (of_first + of_last);
    return search_split(i, 0, most) && search_split(i, most, 1);
  }

  /// Searches the fractions from `low` to `high` of an arc, split where the whole line of a's side is
  /// farthest: the separation is not smooth there.
  bool search_split(std::uint32_t i, double low, double high) {
    if (!a_.has_side) return search_part(i, low, high);
    const Facets::Arc& arc = b_.arcs[i];
    const auto over_side = [&](double part) {
      return -a_.axis.dot(between(arc.first, arc.last, low + part * (high - low))) - a_.sine;
    };
    const double from = over_side(0);
    const double to = over_side(1);
    if (from * to >= 0) return search_part(i, low, high);
    const double part = find_root([&](double p) { return from > 0 ? over_side(p) : -over_side(p); });
    const double corner = low + part * (high - low);
    return consider(between(arc.first, arc.last, corner), i, false) && search_part(i, low, corner) &&
           search_part(i, corner, high);
  }

  /// Searches the fractions from `low` to `high` of an arc, along which the separation is smooth.
  bool search_part(std::uint32_t i, double low, double high) {
    const Facets::Arc& arc = b_.arcs[i];
    const Vector3& vertex = b_.vertices[arc.from];
    const Vector3 along = (b_.vertices[arc.to] - vertex).normalized();
    // Search pieces where the two overlap deeply: an arc can then have several best directions.
    const int pieces = face_.separation < -0.1 * size_ ? 4 : 1;
    for (int k = 0; k < pieces; ++k) {
      const double from = low + (high - low) * k / pieces;
      const double to = low + (high - low) * (k + 1) / pieces;
      const Vector3 middle = between(arc.first, arc.last, (from + to) / 2);
      // Find a's lowest end along the arc, and +1 where along × n points from first to last.
      const bool is_top = a_.has_side ? a_.axis.dot(middle) + a_.sine < 0 : a_.radius[1] > a_.radius[0];
      const double sense = along.cross(middle).dot(arc.last - arc.first) < 0 ? -1 : 1;
      // Differentiate the separation along the arc.
      const auto slope = [&](double part) {
        const Vector3 n = between(arc.first, arc.last, from + part * (to - from));
        return sense * along.cross(n).dot(a_.support(-n, is_top ? 1 : 0) - vertex);
      };
      if (!(slope(0) > 0)) continue;
      const double part = from + find_root(slope) * (to - from);
      if (!consider(between(arc.first, arc.last, part), i, false)) return false;
    }
    return true;
  }

  /// Adds contacts along the preferred axis; where it has none, along the other one.
  void add_contacts() {
    const bool edge_first = edge_.separation > face_.separation + preference(face_.separation);
    if (edge_first && edge_.of_neighbour) return;  // the neighbour has the contact
    if (!edge_first && add_face_contacts()) return;
    // Reject edges that separate the two far less than the face: they do not meet there.
    const bool is_near = edge_.separation > face_.separation - preference(face_.separation);
    if (is_near && !edge_.of_neighbour && add_edge_contacts()) return;
    if (b_.mesh && edge_first) add_face_contacts();
    if (b_.mesh || std::max(edge_.separation, face_.separation) > 0) return;
    // Add a point where all manifolds were empty by rounding: a solid that overlaps a polytope has a contact.
    const FacetsAxis& best =
        edge_.separation > face_.separation ? static_cast<const FacetsAxis&>(edge_) : face_;
    Manifold(best.normal, size_, margin_, out_).add_point(a_.support(-best.normal), best.separation);
  }

  bool add_face_contacts() {
    Manifold manifold(face_.normal, size_, margin_, out_);
    if (face_.of_b) {
      const Polygon polygon = b_.polygon(face_.face, polygon_corners);
      std::visit([&](const auto& feature) { manifold.add(feature, polygon); },
                 feature_towards(a_, -face_.normal));
    } else {
      manifold.add(end_disc(a_, static_cast<int>(face_.face)),
                   b_.polygon(b_.face_towards(face_.normal), polygon_corners));
    }
    // Reject the face where clipping removed the lowest point, but not a mesh's triangle: its neighbour may
    // have that point.
    if (b_.mesh) return manifold.drop_overlaps(edge_.separation);
    return manifold.keep_if_below(face_.separation + preference(face_.separation));
  }

  bool add_edge_contacts() {
    const Vector3& n = edge_.normal;
    const double near = preference(edge_.separation);
    Manifold manifold(n, size_, margin_, out_);
    const Segment line = line_or_point(a_, -n, near);
    if (manifold.add_beside(line, edge_of_b(line, near), near)) return true;
    const Segment exact = line_or_point(a_, -n, flush_fraction * size_);
    return manifold.add_crossing(exact, edge_of_b(exact, flush_fraction * size_));
  }

  /// Returns the edge of b that is highest along the axis to within `near` and most along a's line; a vertex
  /// if there is none.
  Segment edge_of_b(const Segment& of_a, double near) const {
    if (edge_.arc != no_index) return b_.edge(b_.arcs[edge_.arc]);
    const auto [highest, vertex] = b_.extent(edge_.normal);
    Segment best = {b_.vertices[vertex], b_.vertices[vertex]};
    double most = -1;
    for (const Facets::Arc& arc : b_.arcs) {
      if (arc.from != vertex && arc.to != vertex) continue;
      const Segment edge = b_.edge(arc);
      if (std::min(edge_.normal.dot(edge.from), edge_.normal.dot(edge.to)) < highest - near) continue;
      const double along = std::abs((edge.to - edge.from).normalized().dot(of_a.to - of_a.from));
      if (along <= most) continue;
      most = along;
      best = edge;
    }
    return best;
  }

  const RevolvedSolid& a_;
  const Facets& b_;
  double size_;
  double margin_;
  Contacts& out_;
  FacetsFaceAxis face_;
  FacetsEdgeAxis edge_;
};

}  // namespace

void Facets::load(const Polytope& polytope, const Matrix3& rotation) {
  mesh = nullptr;
  around.clear();
  size = 2 * polytope.bounding_radius;
  vertices.clear();
  for (const Vector3& vertex : polytope.vertices) vertices.push_back(rotation * vertex);
  face_begin = polytope.face_begin;
  face_vertices = polytope.face_vertices;
  face_normals.clear();
  for (const Vector3& normal : polytope.face_normals) face_normals.push_back(rotation * normal);
  face_offsets = polytope.face_offsets;
  arcs.clear();
  for (std::size_t e = 0; e < polytope.edges.size(); ++e) {
    arcs.push_back({polytope.edges[e][0], polytope.edges[e][1], face_normals[polytope.edge_faces[e][0]],
                    face_normals[polytope.edge_faces[e][1]]});
  }
}

void Facets::load(const TriangleMesh& from, std::uint32_t triangle, const Vector3& origin, bool from_behind) {
  mesh = &from;
  corners = from.triangles[triangle];
  std::array<std::uint32_t, 3> neighbours = from.neighbours[triangle];
  const double sign = from_behind ? -1 : 1;
  if (from_behind) {
    std::swap(corners[1], corners[2]);
    std::swap(neighbours[0], neighbours[2]);
  }
  vertices.clear();
  for (const std::uint32_t corner : corners) vertices.push_back(from.vertices[corner] - origin);
  face_begin.assign({0, 3});
  face_vertices.assign({0, 1, 2});
  const Vector3 normal = sign * from.normals[triangle];
  face_normals.assign(1, normal);
  face_offsets.assign(1, normal.dot(vertices[0]));
  arcs.clear();
  around.clear();
  double longest = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::uint32_t next = (i + 1) % 3;
    const Vector3 along = vertices[next] - vertices[i];
    longest = std::max(longest, along.squaredNorm());
    const Vector3 beside = along.cross(normal).normalized();
    continues[i] = false;
    if (neighbours[i] == no_index) {
      arcs.push_back({i, next, normal, beside});
      if (from.two_sided) arcs.push_back({i, next, beside, -normal});
      continue;
    }
    const Vector3 other = sign * from.normals[neighbours[i]];
    // The neighbour goes down behind a convex side. Its normal then leans away over the side.
    const double lean = beside.dot(other);
    if (std::abs(lean) <= level && normal.dot(other) > 0) {
      continues[i] = true;
    } else if (lean > 0) {
      around.push_back(other);
      if (normal.dot(other) >= 0) {
        arcs.push_back({i, next, normal, other});
      } else {
        // Split the arc halfway: the chord of a wide arc has no middle.
        const Vector3 middle = between(normal, other, 0.5);
        const Vector3 via = middle.allFinite() && middle.norm() > 0.5 ? middle : beside;
        arcs.push_back({i, next, normal, via});
        arcs.push_back({i, next, via, other});
      }
    }
  }
  size = std::sqrt(longest);
}

bool Facets::pushes(const Vector3& direction, std::uint32_t vertex) const {
  if (!mesh) return true;
  if (direction.dot(face_normals[0]) < 0) return false;
  const std::uint32_t corner = corners[vertex];
  for (std::uint32_t i = mesh->ring_begin[corner]; i < mesh->ring_begin[corner + 1]; ++i) {
    const Vector3 to = mesh->vertices[mesh->ring[i]] - mesh->vertices[corner];
    const double rise = direction.dot(to);
    if (rise > 0 && rise * rise > level * level * to.squaredNorm()) return false;
  }
  return true;
}

std::uint32_t Facets::face_towards(const Vector3& direction) const {
  const std::uint32_t vertex = extent(direction).vertex;
  double most = -infinity;
  std::uint32_t best = 0;
  for (std::uint32_t f = 0; f < face_normals.size(); ++f) {
    const double facing = direction.dot(face_normals[f]);
    if (facing <= most) continue;
    const auto begin = face_vertices.begin() + face_begin[f];
    const auto end = face_vertices.begin() + face_begin[f + 1];
    if (std::find(begin, end, vertex) == end) continue;
    most = facing;
    best = f;
  }
  return best;
}

Polygon Facets::polygon(std::uint32_t face, std::vector<Vector3>& memory) const {
  memory.clear();
  for (std::uint32_t i = face_begin[face]; i < face_begin[face + 1]; ++i) {
    memory.push_back(vertices[face_vertices[i]]);
  }
  Polygon polygon = {memory, face_normals[face], {}};
  if (mesh) polygon.continues = continues;
  return polygon;
}

void find_revolved_facets(const RevolvedSolid& a, const Facets& b, double margin, Contacts& out) {
  RevolvedSearch(a, b, margin, out).find();
}

}  // namespace substep
