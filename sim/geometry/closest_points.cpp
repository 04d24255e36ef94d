#include "sim/geometry/closest_points.h"

#include <algorithm>

namespace substep {

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

  // Of the two lines, then brought back into the segments one after the other. |u × v|² rather than
  // uu vv − (u·v)², which cancels where the segments are nearly parallel.
  const Vector3 between = a.from - b.from;
  const double uv = u.dot(v);
  const double cross = u.cross(v).squaredNorm();
  double s = 0;
  if (cross > 1e-24 * uu * vv) {
    s = std::clamp((uv * v.dot(between) - vv * u.dot(between)) / cross, 0.0, 1.0);
  }
  const double t = closest_parameter(b, point_at(a, s));
  // Exact for every t: it is the closest on a to the point found on b.
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

}  // namespace substep
