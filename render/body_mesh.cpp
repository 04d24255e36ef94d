#include "render/body_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <variant>

#include "sim/math/rotation.h"

namespace substep::render {
namespace {

Vector3 vector_of(const std::array<float, 3>& v) {
  return {v[0], v[1], v[2]};
}

std::array<float, 3> floats_of(const Vector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// Returns the finish of bodies for which the scene has none.
Surface default_surface(int body) {
  // Linear RGB of similar lightness; neighbours differ much in hue.
  static constexpr std::array<std::array<double, 3>, 8> palette{{{0.523, 0.117, 0.052},
                                                                 {0.047, 0.216, 0.402},
                                                                 {0.604, 0.342, 0.056},
                                                                 {0.060, 0.254, 0.176},
                                                                 {0.273, 0.107, 0.266},
                                                                 {0.119, 0.319, 0.381},
                                                                 {0.578, 0.209, 0.168},
                                                                 {0.254, 0.292, 0.072}}};
  Surface surface;
  if (body == world_body) {
    surface.base_color = {0.38, 0.37, 0.35};
    surface.roughness = 0.7;
  } else {
    surface.base_color = palette[(body - 1) % palette.size()];
    surface.roughness = 0.42;
  }
  return surface;
}

/// Returns a hash of the edge from one corner to another, by splitmix64 (Steele, Lea and Flood 2014).
std::uint64_t edge_hash(std::uint64_t from, std::uint64_t to) {
  std::uint64_t x = from + 0x9e3779b97f4a7c15 * (to + 1);
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
  x = (x ^ x >> 27) * 0x94d049bb133111eb;
  return x ^ x >> 31;
}

/// Returns whether each edge has as many triangles on one side as on the other, and they enclose a volume.
/// The part's vertices are those from `first` on.
bool is_closed(const BodyMesh& mesh, const Part& part, std::size_t first) {
  // Give vertices at one corner one key.
  const double grid = 1e-6 * (part.high - part.low).maxCoeff();
  if (!(grid > 0)) return false;
  std::vector<std::uint64_t> keys;
  for (std::size_t i = first; i < mesh.vertices.size(); ++i) {
    const Vector3 p = (vector_of(mesh.vertices[i].position) - part.low) / grid;
    std::uint64_t key = 0;
    for (const double x : {p.x(), p.y(), p.z()})
      key = key << 21 | static_cast<std::uint64_t>(std::llround(x));
    keys.push_back(key);
  }
  // Add each edge's hash and subtract its opposite's: 0 where all edges match, by chance once in 2⁶⁴.
  std::uint64_t unmet = 0;
  double volume = 0;
  for (std::size_t i = part.begin; i < part.end; i += 3) {
    std::array<std::uint64_t, 3> at{};
    std::array<Vector3, 3> points;
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = keys[mesh.indices[i + k] - first];
      points[k] = vector_of(mesh.vertices[mesh.indices[i + k]].position) - part.low;
    }
    if (at[0] == at[1] || at[1] == at[2] || at[2] == at[0]) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      unmet += edge_hash(at[k], at[(k + 1) % 3]) - edge_hash(at[(k + 1) % 3], at[k]);
    }
    volume += points[0].dot(points[1].cross(points[2]));
  }
  return volume > 0 && unmet == 0;
}

/// Adds parts to a mesh, one after the other.
class Gatherer {
 public:
  explicit Gatherer(bool with_looks) : has_looks(with_looks) {}

  BodyMesh mesh;
  const bool has_looks;

  void start_part(int body, const Surface& surface) {
    surface_ = surface;
    first_ = mesh.vertices.size();
    part_ = {.body = body, .begin = mesh.indices.size()};
    part_.low = Vector3::Constant(infinity);
    part_.high = -part_.low;
  }

  std::uint32_t add_vertex(const Vector3& position, const Vector3& normal) {
    const auto& [red, green, blue] = surface_.base_color;
    mesh.vertices.push_back({floats_of(position), floats_of(normal), floats_of({red, green, blue}),
                             static_cast<float>(surface_.metallic), static_cast<float>(surface_.roughness)});
    const Vector3 rounded = vector_of(mesh.vertices.back().position);
    part_.low = part_.low.cwiseMin(rounded);
    part_.high = part_.high.cwiseMax(rounded);
    return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  }

  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vertex& va = mesh.vertices[a];
    const Vertex& vb = mesh.vertices[b];
    const Vertex& vc = mesh.vertices[c];
    const Vector3 pa = vector_of(va.position);
    const Vector3 across = (vector_of(vb.position) - pa).cross(vector_of(vc.position) - pa);
    const Vector3 normals = vector_of(va.normal) + vector_of(vb.normal) + vector_of(vc.normal);
    if (across.dot(normals) < 0) std::swap(b, c);
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  }

  void end_part() {
    if (mesh.vertices.size() == first_) return;
    if (has_looks) mesh.looks.resize(mesh.vertices.size());
    part_.end = mesh.indices.size();
    part_.is_closed = is_closed(mesh, part_, first_);
    mesh.parts.push_back(part_);
    mesh.surfaces.push_back(surface_);
  }

 private:
  Surface surface_;
  Part part_;
  std::size_t first_ = 0;  ///< the part's first vertex
};

void add_visual(Gatherer& gatherer, const Scene& scene, const Visual& visual) {
  const Mesh& mesh = scene.meshes[visual.mesh];
  // The cofactor matrix carries normals under any linear map; it turns them inside out where the map mirrors.
  Matrix3 cofactors;
  for (int i = 0; i < 3; ++i) {
    cofactors.col(i) = visual.linear.col((i + 1) % 3).cross(visual.linear.col((i + 2) % 3));
  }
  if (visual.linear.determinant() < 0) cofactors = -cofactors;
  const bool has_surface = mesh.surface >= 0 && mesh.surface < static_cast<int>(scene.surfaces.size());
  const Surface surface = has_surface ? scene.surfaces[mesh.surface] : default_surface(visual.body);
  gatherer.start_part(visual.body, surface);
  const auto first = static_cast<std::uint32_t>(gatherer.mesh.vertices.size());
  std::vector<Vector3> positions;
  std::vector<Vector3> normals;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vector3 normal = cofactors * mesh.normals[i];
    const double length = normal.norm();
    positions.emplace_back(visual.linear * mesh.positions[i] + visual.translation);
    normals.push_back(length > 0 ? Vector3(normal / length) : Vector3::UnitY());
    gatherer.add_vertex(positions.back(), normals.back());
  }
  if (gatherer.has_looks) {
    const int set = surface.textures[Surface::normal_texture].coordinates;
    const std::vector<LookVertex> looks = look_vertices(mesh, visual.linear, positions, normals, set);
    gatherer.mesh.looks.insert(gatherer.mesh.looks.end(), looks.begin(), looks.end());
  }
  for (const Triangle& triangle : mesh.triangles) {
    gatherer.add_triangle(first + triangle[0], first + triangle[1], first + triangle[2]);
  }
  gatherer.end_part();
}

/// A point of a profile that is turned about the Y axis, with its normal in the profile's plane.
struct ProfilePoint {
  double radius;
  double y;
  double normal_radius;
  double normal_y;
};

/// Adds the surface that a profile sweeps as it is turned, stretched along the axes if wanted.
void add_revolved(Gatherer& gatherer, const Pose& placement, const std::vector<ProfilePoint>& profile,
                  int sectors = 64, const std::optional<Vector3>& stretch = {}) {
  std::vector<std::uint32_t> previous;
  for (const ProfilePoint& point : profile) {
    std::vector<std::uint32_t> circle;
    for (int sector = 0; sector < sectors; ++sector) {
      const SineCosine around = sine_cosine(2 * std::numbers::pi * sector / sectors);
      Vector3 position(point.radius * around.cosine, point.y, point.radius * around.sine);
      Vector3 normal(point.normal_radius * around.cosine, point.normal_y, point.normal_radius * around.sine);
      if (stretch) {
        position = stretch->cwiseProduct(position);
        normal = normal.cwiseQuotient(*stretch).normalized();
      }
      circle.push_back(gatherer.add_vertex(placement * position, placement.orientation * normal));
    }
    for (std::size_t i = 0; !previous.empty() && i < circle.size(); ++i) {
      const std::size_t next = (i + 1) % circle.size();
      gatherer.add_triangle(previous[i], previous[next], circle[i]);
      gatherer.add_triangle(previous[next], circle[next], circle[i]);
    }
    previous = circle;
  }
}

/// Adds a ball cut in two at its equator and drawn apart by `half_length` to both sides: a capsule.
void add_round(Gatherer& gatherer, const Pose& placement, double radius, double half_length) {
  constexpr int rings = 24;  // even: the equator is doubled
  std::vector<ProfilePoint> profile;
  for (int ring = 0; ring <= rings + 1; ++ring) {
    const bool upper = ring <= rings / 2;
    const SineCosine down = sine_cosine(std::numbers::pi * (upper ? ring : ring - 1) / rings);
    const double centre = upper ? half_length : -half_length;
    profile.push_back({radius * down.sine, centre + radius * down.cosine, down.sine, down.cosine});
  }
  add_revolved(gatherer, placement, profile, 48);
}

void add_cylinder(Gatherer& gatherer, const Pose& placement, const Cylinder& cylinder) {
  const double h = cylinder.half_height;
  const double slant = std::hypot(2 * h, cylinder.radius_bottom - cylinder.radius_top);
  const double out = 2 * h / slant;
  const double up = (cylinder.radius_bottom - cylinder.radius_top) / slant;
  // Rims are doubled: they have the normals of both sides.
  add_revolved(gatherer, placement, {{0, h, 0, 1}, {cylinder.radius_top, h, 0, 1}});
  add_revolved(gatherer, placement,
               {{cylinder.radius_top, h, out, up}, {cylinder.radius_bottom, -h, out, up}});
  add_revolved(gatherer, placement, {{cylinder.radius_bottom, -h, 0, -1}, {0, -h, 0, -1}});
}

void add_tapered_capsule(Gatherer& gatherer, const Pose& placement, const TaperedCapsule& capsule) {
  constexpr int rings = 32;
  const double h = capsule.half_length;
  const double difference = capsule.radius_bottom - capsule.radius_top;
  // The height of the normal at which the straight side leaves the upper ball and meets the lower one.
  const double seam = std::abs(difference) >= 2 * h ? (difference > 0 ? 1 : -1) : difference / (2 * h);
  std::vector<ProfilePoint> profile;
  bool upper = true;
  for (int ring = 0; ring <= rings; ++ring) {
    const SineCosine down = sine_cosine(std::numbers::pi * ring / rings);
    const auto add = [&](double radius, double centre, double out, double up) {
      profile.push_back({radius * out, centre + radius * up, out, up});
    };
    if (upper && (down.cosine < seam || ring == rings)) {
      upper = false;
      const double out = std::sqrt(1 - seam * seam);
      add(capsule.radius_top, h, out, seam);
      add(capsule.radius_bottom, -h, out, seam);
    }
    add(upper ? capsule.radius_top : capsule.radius_bottom, upper ? h : -h, down.sine, down.cosine);
  }
  add_revolved(gatherer, placement, profile);
}

void add_polygon(Gatherer& gatherer, const Pose& placement, const std::vector<Vector3>& corners,
                 const Vector3& normal) {
  std::vector<std::uint32_t> indices;
  indices.reserve(corners.size());
  for (const Vector3& corner : corners) {
    indices.push_back(gatherer.add_vertex(placement * corner, placement.orientation * normal));
  }
  for (std::size_t i = 2; i < indices.size(); ++i) {
    gatherer.add_triangle(indices[0], indices[i - 1], indices[i]);
  }
}

void add_polytope(Gatherer& gatherer, const Pose& placement, const Polytope& polytope) {
  std::vector<Vector3> corners;
  for (std::size_t face = 0; face < polytope.face_count(); ++face) {
    corners.clear();
    for (std::size_t i = polytope.face_begin[face]; i < polytope.face_begin[face + 1]; ++i) {
      corners.push_back(polytope.vertices[polytope.face_vertices[i]]);
    }
    add_polygon(gatherer, placement, corners, polytope.face_normals[face]);
  }
}

void add_ellipsoid(Gatherer& gatherer, const Pose& placement, const Vector3& half_axes) {
  constexpr int rings = 32;
  std::vector<ProfilePoint> ball;
  for (int ring = 0; ring <= rings; ++ring) {
    const SineCosine down = sine_cosine(std::numbers::pi * ring / rings);
    ball.push_back({down.sine, down.cosine, down.sine, down.cosine});
  }
  add_revolved(gatherer, placement, ball, 64, half_axes);
}

void add_collider(Gatherer& gatherer, const Collider& collider) {
  gatherer.start_part(collider.body, default_surface(collider.body));
  if (const auto* sphere = std::get_if<Sphere>(&collider.shape)) {
    add_round(gatherer, collider.placement, sphere->radius, 0);
  } else if (const auto* capsule = std::get_if<Capsule>(&collider.shape)) {
    add_round(gatherer, collider.placement, capsule->radius, capsule->half_length);
  } else if (const auto* polytope = std::get_if<Polytope>(&collider.shape)) {
    if (polytope->ellipsoid)
      add_ellipsoid(gatherer, collider.placement, *polytope->ellipsoid);
    else
      add_polytope(gatherer, collider.placement, *polytope);
  } else if (const auto* cylinder = std::get_if<Cylinder>(&collider.shape)) {
    add_cylinder(gatherer, collider.placement, *cylinder);
  } else if (const auto* tapered = std::get_if<TaperedCapsule>(&collider.shape)) {
    add_tapered_capsule(gatherer, collider.placement, *tapered);
  } else if (const auto* mesh = std::get_if<TriangleMesh>(&collider.shape)) {
    for (std::size_t t = 0; t < mesh->triangles.size(); ++t) {
      const Triangle& corners = mesh->triangles[t];
      add_polygon(gatherer, collider.placement,
                  {mesh->vertices[corners[0]], mesh->vertices[corners[1]], mesh->vertices[corners[2]]},
                  mesh->normals[t]);
    }
  } else if (!is_ground(collider)) {
    // Draw a square of the plane, 20 m wide.
    constexpr double reach = 10;
    add_polygon(gatherer, collider.placement,
                {{-reach, 0, -reach}, {-reach, 0, reach}, {reach, 0, reach}, {reach, 0, -reach}},
                Vector3::UnitY());
  }
  gatherer.end_part();
}

}  // namespace

bool is_ground(const Collider& collider) {
  return collider.body == world_body && std::holds_alternative<Plane>(collider.shape) &&
         (collider.placement.orientation * Vector3::UnitY()).y() > 1 - 1e-9;
}

std::array<Vector3, 8> Part::corners_at(const Coordinates& q) const {
  std::array<Vector3, 8> result;
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3 corner((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                         (i & 4) != 0 ? high.z() : low.z());
    result[i] = q.angular * corner + q.linear;
  }
  return result;
}

bool is_drawable(const Coordinates& q) {
  constexpr double farthest = 1e6;
  return q.linear.cwiseAbs().maxCoeff() < farthest && q.angular.coeffs().allFinite();
}

BodyMesh gather_body_mesh(const Scene& scene) {
  Gatherer gatherer(needs_looks(scene));
  for (int body = 0; body < static_cast<int>(scene.bodies.size()); ++body) {
    bool has_visual = false;
    for (const Visual& visual : scene.visuals) {
      if (visual.body != body) continue;
      add_visual(gatherer, scene, visual);
      has_visual = true;
    }
    if (has_visual) continue;
    for (const Collider& collider : scene.colliders) {
      if (collider.body == body) add_collider(gatherer, collider);
    }
  }
  return std::move(gatherer.mesh);
}

bool is_scenery(const Part& part, std::span<const Part> parts) {
  if (part.body != world_body) return false;
  double largest = 0;
  for (const Part& other : parts) {
    if (other.body != world_body) largest = std::max(largest, other.half_size().maxCoeff());
  }
  return largest > 0 && part.half_size().maxCoeff() > 6 * largest;
}

}  // namespace substep::render
