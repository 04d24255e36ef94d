#include "sim/loading/collider_shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "sim/error.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// Returns true for scales that agree to five digits: single precision changes the seventh.
bool is_equal_scale(double a, double b) {
  return std::fabs(a - b) <= 1e-5 * std::max(a, b);
}

/// Returns the result of `make`. Errors of `make` become errors at `place` in the file.
template <typename Make>
Shape made(const JsonValue& place, const Make& make) {
  try {
    return make();
  } catch (const Error& failure) {
    place.fail("{}", failure.what());
  }
}

bool is_uniform(const Vector3& scale) {
  return is_equal_scale(scale.x(), scale.y()) && is_equal_scale(scale.y(), scale.z());
}

/// Adds points on the surface of a ball about (0, y, 0), from one circle of latitude to another.
void add_ball(std::vector<Vector3>& points, double y, double radius, int first_ring, int last_ring) {
  constexpr int sectors = 24;
  constexpr int rings = 12;  // from pole to pole
  for (int ring = first_ring; ring <= last_ring; ++ring) {
    const SineCosine down = sine_cosine(std::numbers::pi * ring / rings);
    const bool is_pole = ring == 0 || ring == rings;
    for (int sector = 0; sector < (is_pole ? 1 : sectors); ++sector) {
      const SineCosine around = sine_cosine(2 * std::numbers::pi * sector / sectors);
      points.emplace_back(is_pole ? 0 : radius * down.sine * around.cosine, y + radius * down.cosine,
                          is_pole ? 0 : radius * down.sine * around.sine);
    }
  }
}

/// Returns the hull of points on a sphere or capsule under a non-uniform scale. `unscaled` caches the hull
/// before scaling. Throws Error where the hull is thinner than 1e-5 of its size.
Shape faceted(const ImplicitShape& shape, const Vector3& scale, std::optional<Polytope>& unscaled,
              const JsonValue& place) {
  if (!(scale.minCoeff() > 1e-5 * scale.maxCoeff())) {
    place.fail("is thinner than 1e-5 of its size; a solid body needs a thickness");
  }
  if (!unscaled && shape.kind == ImplicitShape::Kind::sphere) {
    unscaled =
        std::get<Polytope>(made(place, [&] { return ellipsoid(Vector3::Constant(shape.radius_bottom)); }));
  } else if (!unscaled) {
    std::vector<Vector3> points;
    add_ball(points, shape.height / 2, shape.radius_top, 0, 6);
    add_ball(points, -shape.height / 2, shape.radius_bottom, 6, 12);
    unscaled = convex_hull(points, place.place());
  }
  return scaled(*unscaled, scale);
}

Shape capsule(const ImplicitShape& shape, const Vector3& scale, std::optional<Polytope>& unscaled,
              const JsonValue& place) {
  if (!is_uniform(scale)) {
    Shape hull = faceted(shape, scale, unscaled, place);
    place.warn("a capsule under an unequal scale collides as the hull of {} points on it",
               unscaled->vertices.size());
    return hull;
  }
  const double height = shape.height * scale.x();
  const double bottom = shape.radius_bottom * scale.x();
  const double top = shape.radius_top * scale.x();
  if (height == 0) return Sphere{std::max(bottom, top)};
  if (shape.radius_bottom != shape.radius_top) {
    return made(place, [&] { return make_tapered_capsule(height, bottom, top); });
  }
  return Capsule{height / 2, bottom};
}

/// Returns the outermost points in `directions` directions, which are spread evenly over the sphere along a
/// spiral of golden angles. Each point is listed once, in the order of the points.
std::vector<std::size_t> outermost(std::span<const Vector3> points, std::size_t directions) {
  constexpr double golden_angle = 2.399963229728653;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < directions; ++i) {
    const double y = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(directions);
    const double across = std::sqrt(1 - y * y);
    const SineCosine around = sine_cosine(golden_angle * static_cast<double>(i));
    const Vector3 direction(across * around.cosine, y, across * around.sine);
    std::size_t farthest = 0;
    double largest = -infinity;
    for (std::size_t index = 0; index < points.size(); ++index) {
      const double distance = direction.dot(points[index]);
      if (distance > largest) farthest = index;
      largest = std::max(largest, distance);
    }
    chosen.push_back(farthest);
  }
  std::ranges::sort(chosen);
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

std::vector<Vector3> chosen_points(std::span<const Vector3> points, std::span<const std::size_t> indices) {
  std::vector<Vector3> result;
  for (const std::size_t index : indices) result.push_back(points[index]);
  return result;
}

/// Returns the distances of points from a hull along the lines to its centre, m; 0 inside.
std::vector<double> distances_outside(const Polytope& hull, std::span<const Vector3> points) {
  std::vector<Vector3> poles;  // of the faces: on a face pole · (point − centre) is 1
  for (std::size_t face = 0; face < hull.face_count(); ++face) {
    const Vector3& normal = hull.face_normals[face];
    poles.push_back(normal / (hull.face_offsets[face] - normal.dot(hull.centre)));
  }
  std::vector<double> distances;
  for (const Vector3& point : points) {
    const Vector3 from_centre = point - hull.centre;
    double ratio = 0;
    for (const Vector3& pole : poles) ratio = std::max(ratio, pole.dot(from_centre));
    distances.push_back(ratio > 1 ? from_centre.norm() * (1 - 1 / ratio) : 0);
  }
  return distances;
}

/// Returns true where a connected part of a closed mesh faces inwards and is no cavity: its volume has the
/// other sign than `volume`, the whole's, and no part with that sign has bounds around it.
bool has_inward_part(std::span<const Vector3> points, std::span<const Triangle> triangles, double volume) {
  struct Part {
    double fraction = 0;  // of the whole's volume
    Bounds bounds;
  };
  // Join vertices of each part in a tree of which the first one is the root.
  std::vector<std::uint32_t> joined = welded(points);
  const auto first = [&](std::uint32_t vertex) {
    while (joined[vertex] != vertex) vertex = joined[vertex] = joined[joined[vertex]];
    return vertex;
  };
  for (const auto& [a, b, c] : triangles) {
    for (const std::uint32_t corner : {b, c}) {
      const auto [lesser, greater] = std::minmax({first(a), first(corner)});
      joined[greater] = lesser;
    }
  }
  std::map<std::uint32_t, Part> parts;
  for (const Triangle& triangle : triangles) {
    Part& part = parts[first(triangle[0])];
    for (const std::uint32_t corner : triangle) part.bounds.extend(points[corner]);
    const auto from_first = [&](int corner) -> Vector3 { return points[triangle[corner]] - points[0]; };
    part.fraction += from_first(0).dot(from_first(1).cross(from_first(2))) / (6 * volume);
  }
  return std::ranges::any_of(parts, [&](const auto& inner) {
    return inner.second.fraction < -least_filled && std::ranges::none_of(parts, [&](const auto& outer) {
             return outer.second.fraction > 0 && outer.second.bounds.contains(inner.second.bounds);
           });
  });
}

}  // namespace

Shape implicit_shape(const ImplicitShape& shape, const Vector3& signed_scale,
                     std::optional<Polytope>& faceted_hull, const JsonValue& place) {
  const Vector3 scale = signed_scale.cwiseAbs();
  if (!(scale.minCoeff() > 0)) place.fail("its node's scale is 0 along an axis");
  switch (shape.kind) {
    case ImplicitShape::Kind::sphere:
      if (!is_uniform(scale)) return faceted(shape, scale, faceted_hull, place);
      return Sphere{shape.radius_bottom * scale.x()};
    case ImplicitShape::Kind::box:
      return made(place, [&] { return box(shape.size.cwiseProduct(scale)); });
    case ImplicitShape::Kind::capsule:
      return capsule(shape, scale, faceted_hull, place);
    case ImplicitShape::Kind::cylinder:
      if (is_equal_scale(scale.x(), scale.z())) {
        return made(place, [&] {
          return make_cylinder(shape.height * scale.y(), shape.radius_bottom * scale.x(),
                               shape.radius_top * scale.x());
        });
      }
      place.warn("a cylinder made elliptic by its node's scale collides as a prism of 32 sides");
      return made(place, [&] {
        return scaled(cylinder(shape.height, shape.radius_bottom, shape.radius_top), scale);
      });
    case ImplicitShape::Kind::mesh:  // not reached: scene_colliders.cpp makes meshes
    case ImplicitShape::Kind::plane:
      break;
  }
  if (!shape.double_sided && std::isinf(shape.plane_size[0]) && std::isinf(shape.plane_size[1]))
    return Plane{};
  return made(place, [&] {
    return make_rectangle(shape.plane_size[0] * scale.x(), shape.plane_size[1] * scale.z(),
                          shape.double_sided);
  });
}

SimplifiedHull simplified_hull(std::span<const Vector3> given, const std::string& what) {
  // Limit the vertices: a contact of two hulls costs about the product of their edges; full hulls take long.
  constexpr std::size_t most_vertices = 256;
  constexpr std::size_t most_for_full_hull = 2 * most_vertices;
  if (given.size() <= most_vertices ||
      !std::ranges::all_of(given, [](const Vector3& p) { return p.allFinite(); })) {
    return {convex_hull(given, what), {}};
  }
  // Make the full hull, and return whether it is small enough.
  Polytope full;
  const auto make_full_hull = [&](std::span<const Vector3> points) {
    full = convex_hull(points, what);
    return full.vertices.size() <= most_vertices;
  };
  const std::vector<Vector3> points = distinct(given);
  if (points.size() <= most_for_full_hull && make_full_hull(points)) return {std::move(full), {}};
  std::vector<std::size_t> chosen = outermost(points, most_vertices);
  // Make the full hull if few points are outermost: most points are then inside, where they cost little.
  if (chosen.size() <= most_vertices / 2 && points.size() <= 8 * most_for_full_hull &&
      make_full_hull(points)) {
    return {std::move(full), {}};
  }

  SimplifiedHull result{convex_hull(chosen_points(points, chosen), what), {}};
  // Ignore points inside this hull or almost on it, which are no vertices of the full hull but for rounding.
  const double negligible = 1e-6 * result.hull.bounding_radius;
  const std::vector<double> distances = distances_outside(result.hull, points);
  const std::size_t known = chosen.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (distances[i] > negligible) chosen.push_back(i);
  }
  if (chosen.size() == known) return result;
  // The full hull of all points was made above and had too many vertices.
  const bool is_tried = chosen.size() == points.size();
  if (chosen.size() <= most_for_full_hull && !is_tried) {
    std::ranges::sort(chosen);
    if (make_full_hull(chosen_points(points, chosen))) return {std::move(full), {}};
  }
  result.warning = fmt::format(
      "its convex hull of more than {} vertices is simplified to {}, which leaves out {:.2g} m at most",
      most_vertices, result.hull.vertices.size(), std::ranges::max(distances));
  return result;
}

std::optional<MassProperties> enclosed_solid(std::span<const Vector3> points,
                                             std::span<const Triangle> triangles) {
  if (!is_closed(points, triangles)) return std::nullopt;
  MassProperties solid = mass_properties(points, triangles);
  if (has_inward_part(points, triangles, solid.mass)) return MassProperties{};
  if (solid.mass < 0) {  // inside out
    solid.mass = -solid.mass;
    solid.inertia = -solid.inertia;
  }
  return solid;
}

PrincipalInertia symmetric_principal_inertia(Matrix3 inertia) {
  constexpr double rounding = 1e-12;
  const double largest = inertia.diagonal().cwiseAbs().maxCoeff();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (row != column && std::fabs(inertia(row, column)) <= rounding * largest) inertia(row, column) = 0;
    }
  }
  PrincipalInertia principal = principal_inertia(inertia);
  Vector3& moments = principal.moments;
  const auto equal = [&](int i, int j) { return std::fabs(moments[i] - moments[j]) <= rounding * largest; };
  if (equal(0, 1)) moments[1] = moments[0];
  if (equal(0, 2)) moments[2] = moments[0];
  if (equal(1, 2)) moments[2] = moments[1];
  return principal;
}

}  // namespace substep
