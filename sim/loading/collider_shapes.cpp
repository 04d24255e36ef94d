#include "sim/loading/collider_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "sim/error.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_solids.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/geometry/welded_points.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

// Scales that passed through single precision differ in their seventh digit.
bool is_equal_scale(double a, double b) {
  return std::fabs(a - b) <= 1e-5 * std::max(a, b);
}

// What `make` makes; its complaint, which knows no file, gets the place.
template <typename Make>
Shape made(const JsonValue& place, const Make& make) {
  try {
    return make();
  } catch (const Error& failure) {
    place.fail(failure.what());
  }
}

bool is_uniform(const Vector3& scale) {
  return is_equal_scale(scale.x(), scale.y()) && is_equal_scale(scale.y(), scale.z());
}

// Points on the surface of a ball about (0, y, 0), on circles of latitude between two of them.
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

// A sphere or capsule under an unequal scale, with the hull of points on it, which is made once for all
// scales.
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
    unscaled = convex_hull(points, fmt::format("{}: {}", place.file(), place.path()));
  }
  return scaled(*unscaled, scale);
}

Shape capsule(const ImplicitShape& shape, const Vector3& scale, std::optional<Polytope>& unscaled,
              const JsonValue& place, std::vector<std::string>& warnings) {
  if (!is_uniform(scale)) {
    Shape hull = faceted(shape, scale, unscaled, place);
    warnings.push_back(
        fmt::format("{}: a capsule under an unequal scale collides as the hull of {} points on it",
                    place.path(), unscaled->vertices.size()));
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

/// Finds of many points the outermost in a direction. Points that follow each other in a mesh mostly lie near
/// each other, so blocks of them whose box does not reach far enough are passed over, and so are groups of
/// blocks.
class Outermost {
 public:
  explicit Outermost(std::span<const Vector3> points) : points_(points) {
    std::vector<Vector3> corners;  // of the blocks' boxes
    for (std::size_t begin = 0; begin < points.size(); begin += block_size) {
      blocks_.emplace_back(points.subspan(begin, std::min(block_size, points.size() - begin)));
      corners.push_back(blocks_.back().middle - blocks_.back().half);
      corners.push_back(blocks_.back().middle + blocks_.back().half);
    }
    for (std::size_t begin = 0; begin < corners.size(); begin += 2 * block_size) {
      groups_.emplace_back(
          std::span(corners).subspan(begin, std::min(2 * block_size, corners.size() - begin)));
    }
    for (const Vector3& corner : corners) rounding_ = std::max(rounding_, corner.cwiseAbs().maxCoeff());
    rounding_ *= 1e-14;
  }

  /// The first of several that are as far out. The nearer one of the guesses comes to it, the more is passed
  /// over.
  std::size_t in(const Vector3& direction, std::span<const std::size_t> guesses) const {
    std::size_t best = guesses[0];
    double reach = direction.dot(points_[best]);
    const auto consider = [&](std::size_t i) {
      const double value = direction.dot(points_[i]);
      if (value < reach || (value == reach && i >= best)) return;
      reach = value;
      best = i;
    };
    for (const std::size_t guess : guesses) consider(guess);
    const Vector3 spread = direction.cwiseAbs();
    const auto may_reach = [&](const Box& box) {
      return direction.dot(box.middle) + spread.dot(box.half) + rounding_ >= reach;
    };
    for (std::size_t group = 0; group < groups_.size(); ++group) {
      if (!may_reach(groups_[group])) continue;
      const std::size_t last_block = std::min((group + 1) * block_size, blocks_.size());
      for (std::size_t block = group * block_size; block < last_block; ++block) {
        if (!may_reach(blocks_[block])) continue;
        const std::size_t last = std::min((block + 1) * block_size, points_.size());
        for (std::size_t i = block * block_size; i < last; ++i) consider(i);
      }
    }
    return best;
  }

  /// In each of `directions` directions, spread evenly over the sphere along a spiral of golden angles. In
  /// the order of the points, each once.
  std::vector<std::size_t> in_all(std::size_t directions) const {
    constexpr double golden_angle = 2.399963229728653;
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < directions; ++i) {
      const double y = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(directions);
      const double across = std::sqrt(1 - y * y);
      const SineCosine around = sine_cosine(golden_angle * static_cast<double>(i));
      // Fibonacci numbers of golden angles ago it pointed nearby.
      std::array<std::size_t, 4> guesses{};
      for (std::size_t k = 0; const std::size_t back : {8, 13, 21, 34}) {
        if (i >= back) guesses[k++] = chosen[i - back];
      }
      chosen.push_back(in(Vector3(across * around.cosine, y, across * around.sine), guesses));
    }
    std::ranges::sort(chosen);
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    return chosen;
  }

 private:
  static constexpr std::size_t block_size = 16;
  struct Box {
    explicit Box(std::span<const Vector3> points) {
      Vector3 lower = points[0];
      Vector3 upper = points[0];
      for (const Vector3& point : points) {
        lower = lower.cwiseMin(point);
        upper = upper.cwiseMax(point);
      }
      middle = (lower + upper) / 2;
      half = (upper - lower) / 2;
    }
    Vector3 middle;
    Vector3 half;
  };
  std::span<const Vector3> points_;
  std::vector<Box> blocks_;
  std::vector<Box> groups_;  // of block_size blocks
  double rounding_ = 0;
};

/// How far points lie outside a hull: from a point to where the line to the hull's centre meets its surface.
/// That face is found by walking from face to face, from the last point's on, to greater n·p / d: the
/// greatest of a linear function over the dual polytope's corners, so no other hill stops the walk.
class OutsideDistance {
 public:
  explicit OutsideDistance(const Polytope& hull) : centre_(hull.centre) {
    begin_.assign(hull.face_count() + 1, 0);
    for (const auto& [a, b] : hull.edge_faces) {
      ++begin_[a + 1];
      ++begin_[b + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    neighbours_.resize(2 * hull.edge_faces.size());
    for (const auto& [a, b] : hull.edge_faces) {
      neighbours_[next[a]++] = b;
      neighbours_[next[b]++] = a;
    }
    for (std::size_t face = 0; face < hull.face_count(); ++face) {
      const Vector3& normal = hull.face_normals[face];
      poles_.push_back(normal / (hull.face_offsets[face] - normal.dot(centre_)));
    }
  }

  double of(const Vector3& point) {
    const Vector3 from_centre = point - centre_;
    double ratio = poles_[face_].dot(from_centre);
    for (bool climbs = true; climbs;) {
      climbs = false;
      for (std::uint32_t i = begin_[face_]; i < begin_[face_ + 1]; ++i) {
        const double other = poles_[neighbours_[i]].dot(from_centre);
        if (!(other > ratio)) continue;
        ratio = other;
        face_ = neighbours_[i];
        climbs = true;
        break;
      }
    }
    return ratio > 1 ? from_centre.norm() * (1 - 1 / ratio) : 0;
  }

 private:
  Vector3 centre_;
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> neighbours_;
  std::vector<Vector3> poles_;
  std::uint32_t face_ = 0;
};

/// Whether more than `count` of the points are each the outermost of them in one of the directions, so that
/// they are vertices of their hull.
bool has_more_outermost(std::span<const Vector3> points, std::span<const Vector3> directions,
                        std::size_t count) {
  std::vector<bool> is_outermost(points.size(), false);
  std::size_t found = 0;
  for (const Vector3& direction : directions) {
    const auto farthest =
        std::ranges::max_element(points, {}, [&](const Vector3& point) { return direction.dot(point); });
    const auto index = static_cast<std::size_t>(farthest - points.begin());
    if (is_outermost[index]) continue;
    is_outermost[index] = true;
    if (++found > count) return true;
  }
  return false;
}

std::vector<Vector3> chosen_points(std::span<const Vector3> points, std::span<const std::size_t> indices) {
  std::vector<Vector3> result;
  result.reserve(indices.size());
  for (const std::size_t index : indices) result.push_back(points[index]);
  return result;
}

}  // namespace

Shape implicit_shape(const ImplicitShape& shape, const Vector3& signed_scale,
                     std::optional<Polytope>& faceted_hull, const JsonValue& place,
                     std::vector<std::string>& warnings) {
  const Vector3 scale = signed_scale.cwiseAbs();
  if (!(scale.minCoeff() > 0)) place.fail("its node's scale is 0 along an axis");
  switch (shape.kind) {
    case ImplicitShape::Kind::sphere:
      if (!is_uniform(scale)) return faceted(shape, scale, faceted_hull, place);
      return Sphere{shape.radius_bottom * scale.x()};
    case ImplicitShape::Kind::box:
      return box(shape.size.cwiseProduct(scale));
    case ImplicitShape::Kind::capsule:
      return capsule(shape, scale, faceted_hull, place, warnings);
    case ImplicitShape::Kind::cylinder:
      if (is_equal_scale(scale.x(), scale.z())) {
        return made(place, [&] {
          return make_cylinder(shape.height * scale.y(), shape.radius_bottom * scale.x(),
                               shape.radius_top * scale.x());
        });
      }
      warnings.push_back(place.path() +
                         ": a cylinder made elliptic by its node's scale collides as a prism of 32 sides");
      return scaled(cylinder(shape.height, shape.radius_bottom, shape.radius_top), scale);
    case ImplicitShape::Kind::mesh:  // a collider has the mesh itself
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
  // A contact of two hulls costs about the product of their edges; and a full hull of many points takes long.
  constexpr std::size_t most_vertices = 256;
  constexpr std::size_t most_for_full_hull = 2 * most_vertices;
  if (given.size() <= most_vertices ||
      !std::ranges::all_of(given, [](const Vector3& p) { return p.allFinite(); })) {
    return {convex_hull(given, what), {}};
  }
  const auto full_hull = [&](std::span<const Vector3> points) -> std::optional<SimplifiedHull> {
    Polytope full = convex_hull(points, what);
    if (full.vertices.size() > most_vertices) return std::nullopt;
    return SimplifiedHull{std::move(full), {}};
  };
  const std::vector<Vector3> points = distinct(given);
  if (points.size() <= most_for_full_hull) {
    if (auto full = full_hull(points)) return *full;
  }
  std::vector<std::size_t> chosen = Outermost(points).in_all(most_vertices);
  // Where few are outermost, most are inside and cost a full hull little.
  if (chosen.size() <= most_vertices / 2 && points.size() <= 8 * most_for_full_hull) {
    if (auto full = full_hull(points)) return *full;
  }

  SimplifiedHull result{convex_hull(chosen_points(points, chosen), what), {}};
  // Of the others only those outside can be vertices of the full hull; the rest is rounding.
  const double negligible = 1e-6 * result.hull.bounding_radius;
  OutsideDistance outside(result.hull);
  std::vector<std::size_t> others;
  double left_out = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double distance = outside.of(points[i]);
    if (distance <= negligible) continue;
    left_out = std::max(left_out, distance);
    others.push_back(i);
  }
  if (others.empty()) return result;
  const std::size_t known = chosen.size();
  chosen.insert(chosen.end(), others.begin(), others.end());
  if (chosen.size() <= most_for_full_hull &&
      !has_more_outermost(chosen_points(points, others), result.hull.face_normals, most_vertices - known)) {
    std::ranges::sort(chosen);
    if (auto full = full_hull(chosen_points(points, chosen))) return *full;
  }
  result.warning = fmt::format(
      "its convex hull of more than {} vertices is simplified to {}, which leaves out {:.2g} m at most",
      most_vertices, result.hull.vertices.size(), left_out);
  return result;
}

}  // namespace substep
