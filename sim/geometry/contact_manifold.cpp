#include "sim/geometry/contact_manifold.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/math/find_root.h"

namespace substep {
namespace {

/// A point in a disc or on its outline, and the point of the other feature opposite to it.
struct Pair {
  Vector3 on_disc;
  Vector3 on_other;
  double turn = 0;  ///< grows with the angle round the disc
};

struct Scratch {
  std::vector<Pair> pairs;
  std::vector<Vector3> polygon;
  std::vector<Vector3> clipped;
  std::vector<double> outside;
};

Scratch& scratch() {
  thread_local Scratch memory;
  return memory;
}

/// Returns the point of a plane opposite to `point` along `direction`.
Vector3 onto_plane(const Vector3& point, const Vector3& direction, const Vector3& in_plane,
                   const Vector3& plane_normal) {
  return point + direction * (plane_normal.dot(in_plane - point) / plane_normal.dot(direction));
}

/// Slope below which a disc is parallel to a plane, so that its rim points turn with it. Otherwise a disc
/// that slides flat with a tilt of 1e-6 would have them always at the same position along its slip.
constexpr double parallel = 1e-5;

/// Returns the direction along the disc of steepest descent towards a plane, or `across` where the disc is
/// parallel.
Vector3 downhill(const Disc& disc, const Vector3& plane_normal) {
  const Vector3 down = disc.normal.dot(plane_normal) * disc.normal - plane_normal;
  const double slope = down.norm();
  if (slope <= parallel) return disc.across;
  // Project once more: a vector nearly parallel to the normal is not yet perpendicular to it.
  const Vector3 start = down / slope;
  return (start - disc.normal.dot(start) * disc.normal).normalized();
}

/// Returns a number in [0, 4) that grows with the angle of (x, y).
double turn_of(double x, double y) {
  const double sum = std::abs(x) + std::abs(y);
  if (sum == 0) return 0;
  const double part = y / sum;
  if (x < 0) return 2 - part;
  return part < 0 ? 4 + part : part;
}

/// Returns the fractions of the way from one point to another, both in the disc's plane, at which it crosses
/// the rim.
std::array<double, 2> rim_crossings(const Disc& disc, const Vector3& from, const Vector3& to) {
  const Vector3 start = from - disc.centre;
  const Vector3 along = to - from;
  const double a = along.squaredNorm();
  const double b = along.dot(start);
  // Relative to the nearest point of the line, so that nothing cancels.
  if (a == 0) return {2, -1};
  const double middle = -b / a;
  const double nearest = (start + middle * along).squaredNorm();
  const double rest = disc.radius * disc.radius - nearest;
  if (rest < 0) return {2, -1};
  const double half = std::sqrt(rest / a);
  return {middle - half, middle + half};
}

/// Returns true where a point lies in the prism over the polygon along `direction`, or outside it within the
/// tolerance.
bool is_over(const Polygon& polygon, const Vector3& direction, const Vector3& point, double tolerance) {
  const double facing = polygon.normal.dot(direction) < 0 ? -1 : 1;
  for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
    const Vector3& from = polygon.corners[i];
    const Vector3& to = polygon.corners[i + 1 < polygon.corners.size() ? i + 1 : 0];
    const Vector3 outward = facing * (to - from).cross(direction);
    const double outside = outward.dot(point - from);
    if (outside > 0 && outside * outside > tolerance * tolerance * outward.squaredNorm()) return false;
  }
  return true;
}

/// Cuts the segment to the part within a half-space. False if nothing is left.
bool cut(double from, double to, double tolerance, double& low, double& high) {
  if (from > tolerance && to > tolerance) return false;
  if (from > tolerance) low = std::max(low, from / (from - to));
  if (to > tolerance) high = std::min(high, from / (from - to));
  return low <= high;
}

}  // namespace

Disc end_disc(const RevolvedSolid& solid, int end) {
  return {solid.end(end), end == 0 ? Vector3(-solid.axis) : solid.axis, solid.across, solid.radius[end]};
}

std::array<Vector3, 8> rim_points(const Disc& disc, const Vector3& plane_normal) {
  const Vector3 start = downhill(disc, plane_normal);
  const Vector3 side = disc.normal.cross(start);
  const double r = disc.radius;
  const double d = r * std::sqrt(0.5);
  const Vector3& c = disc.centre;
  return {c + r * start, c + d * (start + side), c + r * side, c + d * (side - start),
          c - r * start, c - d * (start + side), c - r * side, c + d * (start - side)};
}

Segment line_or_point(const RevolvedSolid& solid, const Vector3& direction, double near) {
  Segment line = {solid.support(direction, 0), solid.support(direction, 1)};
  const double tilt = direction.dot(line.to - line.from);
  if (solid.has_side && std::abs(tilt) <= near) return line;
  (tilt > 0 ? line.from : line.to) = tilt > 0 ? line.to : line.from;
  return line;
}

RevolvedFeature feature_towards(const RevolvedSolid& solid, const Vector3& direction) {
  RevolvedFeature feature;
  const double along = solid.axis.dot(direction);
  if (!solid.is_ball_ended) {
    const int end = along < 0 ? 0 : 1;
    // Choose the feature that faces the direction most: the disc, or its side.
    const double side = solid.cosine * solid.outward(direction).norm() + solid.sine * along;
    if (solid.radius[end] > 0 && std::abs(along) >= side) {
      feature.is_disc = true;
      feature.disc = end_disc(solid, end);
      return feature;
    }
  }
  feature.line = {solid.support(direction, 0), solid.support(direction, 1)};
  return feature;
}

void Manifold::push(const Vector3& one, const Vector3& other, bool swapped) {
  const Vector3& on_a = swapped ? other : one;
  const Vector3& on_b = swapped ? one : other;
  const double distance = normal_.dot(on_a - on_b);
  if (distance < margin_) out_.push_back({on_a, on_b, normal_, distance});
}

void Manifold::push_round(double near, bool swapped) {
  std::vector<Pair>& pairs = scratch().pairs;
  std::ranges::sort(pairs, {}, &Pair::turn);
  const auto are_one = [&](std::size_t i, std::size_t j) {
    return (pairs[i].on_disc - pairs[j].on_disc).norm() <= near;
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    // Remove duplicates: crossings of an outline at a rim point or a corner occur twice.
    if (i > 0 && (are_one(i, i - 1) || (i + 1 == pairs.size() && are_one(i, 0)))) continue;
    push(pairs[i].on_disc, pairs[i].on_other, swapped);
  }
}

void Manifold::add_point(const Vector3& on_a, double distance) {
  if (distance < margin_) out_.push_back({on_a, on_a - distance * normal_, normal_, distance});
}

void Manifold::add_disc_polygon(const Disc& disc, const Polygon& polygon, bool polygon_is_a) {
  std::vector<Pair>& pairs = scratch().pairs;
  pairs.clear();
  const double tolerance = flush_share * size_;
  const Vector3 start = downhill(disc, polygon.normal);
  const Vector3 side = disc.normal.cross(start);
  const auto collect = [&](const Vector3& on_disc, const Vector3& on_polygon) {
    const Vector3 from = on_disc - disc.centre;
    pairs.push_back({on_disc, on_polygon, turn_of(start.dot(from), side.dot(from))});
  };
  // Seen edge-on, the polygon has its outline but no points over the disc.
  if (std::abs(polygon.normal.dot(normal_)) > 0.05) {
    for (const Vector3& point : rim_points(disc, polygon.normal)) {
      if (!is_over(polygon, normal_, point, tolerance)) continue;
      collect(point, onto_plane(point, normal_, polygon.corners[0], polygon.normal));
    }
  }
  const auto in_disc_plane = [&](const Vector3& point) {
    return onto_plane(point, normal_, disc.centre, disc.normal);
  };
  for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
    const Vector3& from = polygon.corners[i];
    const Vector3& to = polygon.corners[i + 1 < polygon.corners.size() ? i + 1 : 0];
    const Vector3 foot = in_disc_plane(from);
    // Corners and sides within a plane surface are none of its outline.
    const bool goes_on = !polygon.goes_on.empty() && polygon.goes_on[i];
    const bool went_on = goes_on && polygon.goes_on[i > 0 ? i - 1 : polygon.corners.size() - 1];
    if (!went_on && (foot - disc.centre).norm() <= disc.radius + tolerance) collect(foot, from);
    if (goes_on) continue;
    const Vector3 end = in_disc_plane(to);
    for (const double part : rim_crossings(disc, foot, end)) {
      if (part <= 0 || part >= 1) continue;
      collect(foot + part * (end - foot), from + part * (to - from));
    }
  }
  push_round(1e-6 * disc.radius, polygon_is_a);
}

void Manifold::add(const Disc& a, const Disc& b) {
  std::vector<Pair>& pairs = scratch().pairs;
  pairs.clear();
  const double tolerance = flush_share * size_;
  const Vector3 start = downhill(a, b.normal);
  const Vector3 side = a.normal.cross(start);
  const auto collect = [&](const Vector3& on_a, const Vector3& on_b) {
    const Vector3 from = on_a - a.centre;
    pairs.push_back({on_a, on_b, turn_of(start.dot(from), side.dot(from))});
  };
  for (const Vector3& point : rim_points(a, b.normal)) {
    const Vector3 foot = onto_plane(point, normal_, b.centre, b.normal);
    if ((foot - b.centre).norm() <= b.radius + tolerance) collect(point, foot);
  }
  for (const Vector3& point : rim_points(b, a.normal)) {
    const Vector3 foot = onto_plane(point, normal_, a.centre, a.normal);
    // Equal discs one on the other have one rim.
    if ((foot - a.centre).norm() < a.radius - tolerance) collect(foot, point);
  }
  // Where the rims cross: between two neighbouring rim points of a of which one is over b.
  const std::array<Vector3, 8> rim = rim_points(a, b.normal);
  const auto beyond = [&](const Vector3& point) {
    return (onto_plane(point, normal_, b.centre, b.normal) - b.centre).norm() - b.radius;
  };
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3& from = rim[i];
    const Vector3& to = rim[(i + 1) % 8];
    const bool leaves = beyond(from) <= tolerance;
    if (leaves == (beyond(to) <= tolerance)) continue;
    const auto on_rim = [&](double part) -> Vector3 {
      return a.centre + a.radius * (from + part * (to - from) - a.centre).normalized();
    };
    const double part = find_root([&](double p) { return (leaves ? -1 : 1) * beyond(on_rim(p)); });
    const Vector3 point = on_rim(part);
    collect(point, onto_plane(point, normal_, b.centre, b.normal));
  }
  push_round(1e-6 * std::min(a.radius, b.radius), false);
}

void Manifold::add_disc_segment(const Disc& disc, const Segment& line, bool line_is_a) {
  const Vector3 from = onto_plane(line.from, normal_, disc.centre, disc.normal);
  const Vector3 to = onto_plane(line.to, normal_, disc.centre, disc.normal);
  const double tolerance = flush_share * size_;
  const auto add_end = [&](double part) { push(from + part * (to - from), point_at(line, part), line_is_a); };
  if ((to - from).norm() <= tolerance) {
    if ((from - disc.centre).norm() > disc.radius + tolerance) return;
    add_end(disc.normal.dot(line.from - line.to) * disc.normal.dot(normal_) > 0 ? 1 : 0);
    return;
  }
  const auto [first, last] = rim_crossings(disc, from, to);
  const double low = std::max(first, 0.0);
  const double high = std::min(last, 1.0);
  if (low > high) return;
  add_end(low);
  if ((high - low) * (to - from).norm() > tolerance) add_end(high);
}

void Manifold::add(const Segment& a, const Polygon& b) {
  const double tolerance = flush_share * size_;
  double low = 0;
  double high = 1;
  for (std::size_t i = 0; i < b.corners.size(); ++i) {
    const Vector3& from = b.corners[i];
    const Vector3& to = b.corners[i + 1 < b.corners.size() ? i + 1 : 0];
    const Vector3 outward = (to - from).cross(b.normal).normalized();
    if (!cut(outward.dot(a.from - from), outward.dot(a.to - from), tolerance, low, high)) return;
  }
  const auto add_end = [&](double part) {
    const Vector3 point = point_at(a, part);
    push(point, onto_plane(point, normal_, b.corners[0], b.normal), false);
  };
  const Vector3 along = a.to - a.from;
  const double length = (high - low) * (along - normal_.dot(along) * normal_).norm();
  if (length > tolerance) {
    add_end(low);
    add_end(high);
  } else {
    add_end(normal_.dot(along) < 0 ? high : low);
  }
}

void Manifold::add(const Polygon& a, const Polygon& b, bool reference_is_b) {
  const Polygon& reference = reference_is_b ? b : a;
  const Polygon& incident = reference_is_b ? a : b;
  const double tolerance = flush_share * size_;
  std::vector<Vector3>& polygon = scratch().polygon;
  std::vector<Vector3>& clipped = scratch().clipped;
  std::vector<double>& outside = scratch().outside;
  // Give both buffers the size of the larger, since they swap at each cut.
  polygon.reserve(clipped.capacity());
  clipped.reserve(polygon.capacity());
  polygon.assign(incident.corners.begin(), incident.corners.end());
  for (std::size_t i = 0; i < reference.corners.size() && !polygon.empty(); ++i) {
    const Vector3& from = reference.corners[i];
    const Vector3& to = reference.corners[i + 1 < reference.corners.size() ? i + 1 : 0];
    const Vector3 outward = (to - from).cross(reference.normal).normalized();
    outside.clear();
    for (const Vector3& point : polygon) outside.push_back(outward.dot(point - from));
    clipped.clear();
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const std::size_t next = k + 1 < polygon.size() ? k + 1 : 0;
      const bool is_in = outside[k] <= tolerance;
      if (is_in) clipped.push_back(polygon[k]);
      if (is_in == (outside[next] <= tolerance)) continue;
      const double part = std::clamp(outside[k] / (outside[k] - outside[next]), 0.0, 1.0);
      clipped.push_back(polygon[k] + part * (polygon[next] - polygon[k]));
    }
    polygon.swap(clipped);
  }
  for (const Vector3& point : polygon) {
    push(point, onto_plane(point, normal_, reference.corners[0], reference.normal), !reference_is_b);
  }
}

bool Manifold::is_across(const Vector3& gap, double tolerance) const {
  return (gap - normal_.dot(gap) * normal_).norm() <= tolerance;
}

bool Manifold::add_beside(const Segment& a, const Segment& b, double preference) {
  const SegmentParameters closest = closest_parameters(a, b);
  const double distance = normal_.dot(point_at(a, closest.on_a) - point_at(b, closest.on_b));
  const double first = closest_parameter(a, b.from);
  const double last = closest_parameter(a, b.to);
  const std::array<double, 2> ends = {std::min(first, last), std::max(first, last)};
  if ((ends[1] - ends[0]) * (a.to - a.from).norm() <= preference) return false;
  std::array<Vector3, 2> points;
  std::array<double, 2> distances;
  for (std::size_t i = 0; i < 2; ++i) {
    points[i] = point_at(a, ends[i]);
    const Vector3 gap = points[i] - point_at(b, closest_parameter(b, points[i]));
    distances[i] = normal_.dot(gap);
    if (!is_across(gap, preference) || distances[i] - distance > preference) return false;
  }
  for (std::size_t i = 0; i < 2; ++i) add_point(points[i], distances[i]);
  return true;
}

bool Manifold::add_crossing(const Segment& a, const Segment& b) {
  const SegmentParameters closest = closest_parameters(a, b);
  const Vector3 on_a = point_at(a, closest.on_a);
  const Vector3 gap = on_a - point_at(b, closest.on_b);
  if (!is_across(gap, 1e-6 * size_)) return false;
  add_point(on_a, normal_.dot(gap));
  return true;
}

}  // namespace substep
