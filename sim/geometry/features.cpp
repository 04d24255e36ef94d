#include "sim/geometry/features.h"

#include <algorithm>
#include <cmath>

namespace substep {
namespace {

/// A point in a disc or on its outline, and the point of the other feature opposite to it.
struct Pair {
  Vector3 on_disc;
  Vector3 on_other;
  double turn = 0;  ///< grows with the angle round the disc
};

struct FeatureMemory {
  std::vector<Pair> pairs;
  CutPolygon common;
};

thread_local FeatureMemory feature_memory;

/// Returns the point of a plane opposite to `point` along `direction`.
Vector3 onto_plane(const Vector3& point, const Vector3& direction, const Vector3& in_plane,
                   const Vector3& plane_normal) {
  return point + direction * (plane_normal.dot(in_plane - point) / plane_normal.dot(direction));
}

/// Slope below which a disc is parallel to a plane, so that its rim points turn with it. Otherwise a disc
/// that slides flat with a tilt of 1e-6 would have them always at the same position along its slip.
constexpr double parallel = 1e-5;

/// Returns the disc's direction of steepest descent towards a plane, or `across` where the two are parallel.
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
  const double fraction = y / sum;
  if (x < 0) return 2 - fraction;
  return fraction < 0 ? 4 + fraction : fraction;
}

/// Returns the fractions of the way between two points of the disc's plane at which the line crosses the rim;
/// {2, −1} where it does not.
std::array<double, 2> rim_crossings(const Disc& disc, const Vector3& from, const Vector3& to) {
  const Vector3 start = from - disc.centre;
  const Vector3 along = to - from;
  const double a = along.squaredNorm();
  const double b = along.dot(start);
  if (a == 0) return {2, -1};
  // Measure from the line's point nearest to the centre, so that nothing cancels.
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
    const auto [from, to] = polygon.side(i);
    const Vector3 outward = facing * (to - from).cross(direction);
    const double outside = outward.dot(point - from);
    if (outside > 0 && outside * outside > tolerance * tolerance * outward.squaredNorm()) return false;
  }
  return true;
}

/// The order of points around a disc, from its lowest point over a plane. Collects pairs in feature_memory.
struct RoundOrder {
  RoundOrder(const Disc& disc, const Vector3& plane_normal)
      : centre(disc.centre), start(downhill(disc, plane_normal)), side(disc.normal.cross(start)) {
    feature_memory.pairs.clear();
  }
  void collect(const Vector3& on_disc, const Vector3& on_other) const {
    const Vector3 from = on_disc - centre;
    feature_memory.pairs.push_back({on_disc, on_other, turn_of(start.dot(from), side.dot(from))});
  }

  Vector3 centre;
  Vector3 start;
  Vector3 side;
};

}  // namespace

double closest_parameter(const Segment& segment, const Vector3& point) {
  const Vector3 along = segment.to - segment.from;
  const double squared = along.squaredNorm();
  if (squared == 0) return 0;
  return std::clamp(along.dot(point - segment.from) / squared, 0.0, 1.0);
}

SegmentParameters closest_parameters(const Segment& a, const Segment& b) {
  const Vector3 u = a.to - a.from;
  const Vector3 v = b.to - b.from;
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  if (uu == 0) return {0, closest_parameter(b, a.from)};
  if (vv == 0) return {closest_parameter(a, b.from), 0};

  // Find the closest points of the lines, then bring them back into the segments one after the other. |u ×
  // v|² replaces uu vv − (u·v)², which cancels where the segments are nearly parallel.
  const Vector3 between = a.from - b.from;
  const double uv = u.dot(v);
  const double cross = u.cross(v).squaredNorm();
  double s = 0;
  if (cross > 1e-24 * uu * vv) {
    s = std::clamp((uv * v.dot(between) - vv * u.dot(between)) / cross, 0.0, 1.0);
  }
  const double t = closest_parameter(b, point_at(a, s));
  // Correct s for the point found on b, which is exact for every t.
  s = closest_parameter(a, point_at(b, t));
  return {s, closest_parameter(b, point_at(a, s))};
}

bool is_over(const Polytope& polytope, std::size_t face, const Vector3& point) {
  bool over = true;
  for_each_side(polytope, face, [&](const Vector3& corner, const Vector3& outward) {
    over = over && outward.dot(point - corner) <= 0;
  });
  return over;
}

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
  const double along = solid.axis.dot(direction);
  if (!solid.is_ball_ended) {
    const int end = along < 0 ? 0 : 1;
    // Choose the feature that faces the direction most: the disc, or its side.
    const double side = solid.cosine * solid.outward(direction).norm() + solid.sine * along;
    if (solid.radius[end] > 0 && std::abs(along) >= side) return end_disc(solid, end);
  }
  return Segment{solid.support(direction, 0), solid.support(direction, 1)};
}

void Manifold::push(const Vector3& one, const Vector3& other, bool swapped) {
  const Vector3& on_a = swapped ? other : one;
  const Vector3& on_b = swapped ? one : other;
  const double distance = normal_.dot(on_a - on_b);
  if (distance < margin_) out_.push_back({on_a, on_b, normal_, distance});
}

void Manifold::push_round(double near) {
  std::vector<Pair>& pairs = feature_memory.pairs;
  std::ranges::sort(pairs, {}, &Pair::turn);
  const auto are_one = [&](std::size_t i, std::size_t j) {
    return (pairs[i].on_disc - pairs[j].on_disc).norm() <= near;
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    // Remove duplicates: crossings of an outline at a rim point or a corner occur twice.
    if (i > 0 && (are_one(i, i - 1) || (i + 1 == pairs.size() && are_one(i, 0)))) continue;
    push(pairs[i].on_disc, pairs[i].on_other, false);
  }
}

void Manifold::add_point(const Vector3& on_a, double distance) {
  if (distance < margin_) out_.push_back({on_a, on_a - distance * normal_, normal_, distance});
}

bool Manifold::keep_if_below(double highest) {
  const bool is_kept = std::any_of(out_.begin() + static_cast<std::ptrdiff_t>(first_), out_.end(),
                                   [&](const ContactPoint& point) { return point.distance <= highest; });
  if (!is_kept) out_.resize(first_);
  return is_kept;
}

bool Manifold::drop_overlaps(double separation) {
  const double tolerance = flush_fraction * size_;
  const auto overlaps = [&](const ContactPoint& point) { return point.distance < -tolerance; };
  const auto begin = out_.begin() + static_cast<std::ptrdiff_t>(first_);
  if (separation >= -tolerance) out_.erase(std::remove_if(begin, out_.end(), overlaps), out_.end());
  return out_.size() > first_;
}

void Manifold::add(const Disc& disc, const Polygon& polygon) {
  const double tolerance = flush_fraction * size_;
  const RoundOrder order(disc, polygon.normal);
  // Collect rim points over the polygon, unless it is seen edge-on and has no inside.
  if (std::abs(polygon.normal.dot(normal_)) > 0.05) {
    for (const Vector3& point : rim_points(disc, polygon.normal)) {
      if (!is_over(polygon, normal_, point, tolerance)) continue;
      order.collect(point, onto_plane(point, normal_, polygon.corners[0], polygon.normal));
    }
  }
  const auto in_disc_plane = [&](const Vector3& point) {
    return onto_plane(point, normal_, disc.centre, disc.normal);
  };
  for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
    const auto [from, to] = polygon.side(i);
    const Vector3 foot = in_disc_plane(from);
    // Skip corners and sides within a plane surface, which are not on its outline.
    const bool is_inner = !polygon.continues.empty() && polygon.continues[i];
    const bool is_after_inner = is_inner && polygon.continues[i > 0 ? i - 1 : polygon.corners.size() - 1];
    if (!is_after_inner && (foot - disc.centre).norm() <= disc.radius + tolerance) order.collect(foot, from);
    if (is_inner) continue;
    const Vector3 end = in_disc_plane(to);
    for (const double part : rim_crossings(disc, foot, end)) {
      if (part <= 0 || part >= 1) continue;
      order.collect(foot + part * (end - foot), from + part * (to - from));
    }
  }
  push_round(1e-6 * disc.radius);
}

void Manifold::add(const Disc& a, const Disc& b) {
  const double tolerance = flush_fraction * size_;
  const RoundOrder order(a, b.normal);
  const std::array<Vector3, 8> rim = rim_points(a, b.normal);
  const auto opposite = [&](const Vector3& point, const Disc& disc) {
    return onto_plane(point, normal_, disc.centre, disc.normal);
  };
  // Collect rim points of each disc that lie over the other.
  for (const Vector3& point : rim) {
    const Vector3 foot = opposite(point, b);
    if ((foot - b.centre).norm() <= b.radius + tolerance) order.collect(point, foot);
  }
  for (const Vector3& point : rim_points(b, a.normal)) {
    const Vector3 foot = opposite(point, a);
    // Skip points on the other rim: equal discs one on the other have one rim.
    if ((foot - a.centre).norm() < a.radius - tolerance) order.collect(foot, point);
  }
  // Collect crossings of the rims: between two neighbouring rim points of a of which one is over b.
  const auto beyond = [&](const Vector3& point) { return (opposite(point, b) - b.centre).norm() - b.radius; };
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3& from = rim[i];
    const Vector3& to = rim[(i + 1) % 8];
    const bool leaves = beyond(from) <= tolerance;
    if (leaves == (beyond(to) <= tolerance)) continue;
    const auto on_rim = [&](double part) -> Vector3 {
      return a.centre + a.radius * (from + part * (to - from) - a.centre).normalized();
    };
    const Vector3 point = on_rim(find_root([&](double p) { return (leaves ? -1 : 1) * beyond(on_rim(p)); }));
    order.collect(point, opposite(point, b));
  }
  push_round(1e-6 * std::min(a.radius, b.radius));
}

void Manifold::add_disc_segment(const Disc& disc, const Segment& line, bool line_is_a) {
  const Vector3 from = onto_plane(line.from, normal_, disc.centre, disc.normal);
  const Vector3 to = onto_plane(line.to, normal_, disc.centre, disc.normal);
  const double tolerance = flush_fraction * size_;
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
  const double tolerance = flush_fraction * size_;
  double low = 0;
  double high = 1;
  for (std::size_t i = 0; i < b.corners.size(); ++i) {
    const auto [from, to] = b.side(i);
    const Vector3 outward = (to - from).cross(b.normal).normalized();
    if (!cut_interval(outward.dot(a.from - from), outward.dot(a.to - from), tolerance, low, high)) return;
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
  const double tolerance = flush_fraction * size_;
  CutPolygon& common = feature_memory.common;
  common.clear();
  common.corners.assign(incident.corners.begin(), incident.corners.end());
  for (std::size_t i = 0; i < reference.corners.size(); ++i) {
    const Segment side = reference.side(i);
    const Vector3 outward = (side.to - side.from).cross(reference.normal).normalized();
    common.cut(tolerance, [&](const Vector3& point) { return outward.dot(point - side.from); });
  }
  for (const Vector3& point : common.corners) {
    push(point, onto_plane(point, normal_, reference.corners[0], reference.normal), !reference_is_b);
  }
}

bool Manifold::is_along_normal(const Vector3& gap, double tolerance) const {
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
    if (!is_along_normal(gap, preference) || distances[i] - distance > preference) return false;
  }
  for (std::size_t i = 0; i < 2; ++i) add_point(points[i], distances[i]);
  return true;
}

bool Manifold::add_crossing(const Segment& a, const Segment& b) {
  ClosestPair closest;
  closest.consider(a, b);
  const Vector3 gap = closest.on_a - closest.on_b;
  if (!is_along_normal(gap, 1e-6 * size_)) return false;
  add_point(closest.on_a, normal_.dot(gap));
  return true;
}

}  // namespace substep
