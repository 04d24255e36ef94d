#include "sim/measure/passage_meter.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/features.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/math/rotation.h"
#include "sim/measure/motion.h"

namespace substep {
namespace {

constexpr double most_turn = 2.5;    // rad a step: beyond, half a turn more looks like one less
constexpr double piece_turn = 0.05;  // rad that a straight piece of a path stands for
constexpr double opposite = -0.5;    // cosine of two sides' normals
constexpr double core = 0.5;         // of a round shape's radius

using Path = std::vector<Vector3>;

struct InnerRadius {
  double operator()(const Sphere& s) const { return s.radius; }
  double operator()(const Capsule& c) const { return c.radius; }
  double operator()(const TaperedCapsule& c) const { return std::min(c.radius_bottom, c.radius_top); }
  double operator()(const Cylinder& c) const {
    return std::min(c.half_height, 0.5 * std::max(c.radius_bottom, c.radius_top));
  }
  double operator()(const Polytope& p) const { return p.inner_radius; }
  double operator()(const Plane&) const { return infinity; }
  double operator()(const TriangleMesh&) const { return infinity; }
};

/// A crossing of a segment and a solid's surface.
struct Crossing {
  double part;  ///< of the segment's length
  Vector3 normal;
  bool goes_in;  ///< from the front
};

/// Returns the crossings of a segment that is partly inside: of the face of entry and of the face of exit.
std::vector<Crossing> crossings_of(const Polytope& polytope, const Vector3& from, const Vector3& to) {
  Crossing in{0, Vector3::Zero(), true};
  Crossing out{1, Vector3::Zero(), false};
  for (std::size_t face = 0; face < polytope.face_count(); ++face) {
    const Vector3& normal = polytope.face_normals[face];
    const double start = normal.dot(from) - polytope.face_offsets[face];
    const double end = normal.dot(to) - polytope.face_offsets[face];
    if (start > 0 && end > 0) return {};
    if (start <= 0 && end <= 0) continue;
    const double part = start / (start - end);
    if (start > 0 && part >= in.part) in = {part, normal, true};
    if (end > 0 && part <= out.part) out = {part, normal, false};
  }
  if (in.part >= out.part) return {};
  std::vector<Crossing> crossings;
  for (const Crossing& crossing : {in, out}) {
    const bool ends_inside = crossing.normal.isZero(0);
    if (!ends_inside) crossings.push_back(crossing);
  }
  return crossings;
}

/// Returns true where the path passes through a capsule, or through a ball if `half_length` is 0.
bool passes_round_solid(double half_length, double radius, const Path& path) {
  const Segment axis{{0, -half_length, 0}, {0, half_length, 0}};
  const auto distance = [&](const Segment& piece) {
    const SegmentParameters closest = closest_parameters(piece, axis);
    return (point_at(piece, closest.on_a) - point_at(axis, closest.on_b)).norm();
  };
  if (distance({path[0], path[0]}) < radius) return false;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    if (distance({path[i], path[i + 1]}) < core * radius) return true;
  }
  return false;
}

std::vector<Crossing> crossings_of(const TriangleMesh& mesh, const Vector3& from, const Vector3& to) {
  std::vector<std::uint32_t> near;
  find_triangles(mesh, {from.cwiseMin(to), from.cwiseMax(to)}, near);
  std::vector<Crossing> crossings;
  for (const std::uint32_t index : near) {
    const Triangle& triangle = mesh.triangles[index];
    const Vector3& normal = mesh.normals[index];
    const Vector3& corner = mesh.vertices[triangle[0]];
    const double start = normal.dot(from - corner);
    const double end = normal.dot(to - corner);
    if ((start > 0) == (end > 0)) continue;
    const double part = start / (start - end);
    const Vector3 point = from + part * (to - from);
    bool is_within = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3& one = mesh.vertices[triangle[k]];
      const Vector3& next = mesh.vertices[triangle[(k + 1) % 3]];
      is_within = is_within && (next - one).cross(point - one).dot(normal) >= 0;
    }
    if (is_within) crossings.push_back({part, normal, start > 0});
  }
  std::ranges::sort(crossings, {}, &Crossing::part);
  return crossings;
}

/// Returns true where the path leaves a convex solid by a side that faces away from the one where it came in;
/// of a mesh also where it crosses two-sided triangles, or ends behind the front.
template <typename Solid>
bool passes_through(const Solid& solid, const Path& path) {
  constexpr bool is_mesh = std::is_same_v<Solid, TriangleMesh>;
  bool is_inside = false;
  Vector3 entered = Vector3::Zero();  // the normal of the side
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    for (const Crossing& crossing : crossings_of(solid, path[i], path[i + 1])) {
      if constexpr (is_mesh) {
        if (solid.two_sided) return true;
      }
      if (crossing.goes_in && !is_inside) entered = crossing.normal;
      if (!crossing.goes_in && is_inside && entered.dot(crossing.normal) < opposite) return true;
      is_inside = crossing.goes_in;
    }
  }
  return is_mesh && is_inside;
}

}  // namespace

Pose PassageMeter::BodyMotion::at(double time) const {
  return {time < bend ? Vector3(from.linear + time * velocity_before)
                      : Vector3(to.linear - (step - time) * velocity_after),
          from.angular * rotation_quaternion((time / step) * turn)};
}

PassageMeter::PassageMeter(const Scene& scene, const State& start)
    : scene_(scene),
      model_(build_model(scene)),
      finder_(scene, model_),
      reaches_(scene.bodies.size(), 0),
      before_(start),
      motions_(scene.bodies.size()) {
  if (!model_.contacts) return;
  for (const Collider& collider : scene.colliders) {
    Obstacle& obstacle = obstacles_.emplace_back();
    obstacle.middle = collider.placement.position;
    if (const auto* const polytope = std::get_if<Polytope>(&collider.shape)) {
      obstacle.facets = *polytope;
      obstacle.middle = collider.placement * polytope->centre;
    } else if (const auto* const c = std::get_if<Cylinder>(&collider.shape)) {
      obstacle.facets = cylinder(2 * c->half_height, c->radius_bottom, c->radius_top, 16);
    }
    obstacle.inner = std::visit(InnerRadius{}, collider.shape);
    const Bounds around = bounds(collider.shape, collider.placement);
    obstacle.reach = around.min().cwiseAbs().cwiseMax(around.max().cwiseAbs()).norm();
    thinnest_ = std::min(thinnest_, obstacle.inner);
    reaches_[collider.body] = std::max(reaches_[collider.body], obstacle.reach);
  }
}

double PassageMeter::longest_path(std::size_t point, std::size_t through) const {
  const Vector3& middle = obstacles_[point].middle;
  const BodyMotion& motion = motions_[scene_.colliders[point].body];
  const BodyMotion& frame = motions_[scene_.colliders[through].body];
  const double apart =
      (motion.from.linear - frame.from.linear).norm() + motion.length + frame.length + middle.norm();
  return motion.length + frame.length + motion.spun * middle.norm() + frame.spun * apart;
}

bool PassageMeter::passes(std::size_t point, std::size_t through) const {
  const Collider& one = scene_.colliders[point];
  const Collider& other = scene_.colliders[through];
  // A mesh has no middle and does not move; a plane has neither.
  if (std::isinf(obstacles_[point].inner) || std::holds_alternative<Plane>(other.shape)) return false;
  const BodyMotion& motion = motions_[one.body];
  const BodyMotion& frame = motions_[other.body];
  if (!(motion.spun < most_turn && frame.spun < most_turn)) return false;
  if (longest_path(point, through) <= obstacles_[point].inner) return false;
  const double turn = motion.turn.norm() + frame.turn.norm();
  std::vector<double> times{0, motion.bend, frame.bend};
  const int pieces = 1 + static_cast<int>(turn / piece_turn);
  for (int i = 1; i <= pieces; ++i) times.push_back(motion.step * i / pieces);
  std::ranges::sort(times);
  Path path;
  for (const double time : times) {
    const Pose frame_at = frame.at(time) * other.placement;
    path.push_back(frame_at.inverse() * (motion.at(time) * obstacles_[point].middle));
  }
  if (const auto& facets = obstacles_[through].facets) return passes_through(*facets, path);
  if (const auto* const mesh = std::get_if<TriangleMesh>(&other.shape)) return passes_through(*mesh, path);
  double half_length = 0;
  if (const auto* const capsule = std::get_if<Capsule>(&other.shape)) half_length = capsule->half_length;
  if (const auto* const capsule = std::get_if<TaperedCapsule>(&other.shape))
    half_length = capsule->half_length;
  return passes_round_solid(half_length, obstacles_[through].inner, path);
}

void PassageMeter::add(const State& state, double step) {
  if (!model_.contacts) return;
  double longest = 0;
  for (std::size_t i = 0; i < state.q.size(); ++i) {
    const Coordinates& from = before_.q[i];
    const Coordinates& to = state.q[i];
    const Vector3 turn = rotation_vector(from.angular.conjugate() * to.angular);
    // It bends where the two straight parts meet, or come closest.
    const Vector3 change = before_.v[i].linear - state.v[i].linear;
    const Vector3 left = to.linear - from.linear - step * state.v[i].linear;
    const double squared = change.squaredNorm();
    const double bend = squared > 0 ? std::clamp(left.dot(change) / squared, 0.0, step) : 0;
    const double length = bend * before_.v[i].linear.norm() + (step - bend) * state.v[i].linear.norm();
    const double spun = step * std::max(before_.v[i].angular.norm(), state.v[i].angular.norm());
    motions_[i] = {from, to, before_.v[i].linear, state.v[i].linear, step, bend, turn, length, spun};
    longest = std::max(longest, length + spun * reaches_[i]);
  }
  before_.q = state.q;
  before_.v = state.v;
  // Return where two bodies approach by less than the thinnest one: at most twice the longest movement.
  if (2 * longest <= thinnest_) return;
  bounds_.clear();
  for (std::size_t i = 0; i < scene_.colliders.size(); ++i) {
    const Collider& collider = scene_.colliders[i];
    const BodyMotion& motion = motions_[collider.body];
    const Pose pose = Pose{motion.from.linear, motion.from.angular} * collider.placement;
    Bounds& box = bounds_.emplace_back(bounds(collider.shape, pose));
    const double margin = motion.length + motion.spun * obstacles_[i].reach;
    box.min().array() -= margin;
    box.max().array() += margin;
  }
  broad_phase_.find_pairs(bounds_, pairs_);
  for (const auto& [i, j] : pairs_) {
    const int one = scene_.colliders[i].body;
    const int other = scene_.colliders[j].body;
    if (finder_.may_meet(i, j) && (passes(i, j) || passes(j, i))) passages_.insert(std::minmax(one, other));
  }
}

}  // namespace substep
