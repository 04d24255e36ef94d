// Contacts of cylinders, cones and tapered capsules with planes, polytopes, round shapes and each other.

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/geometry/contact_facets.h"
#include "sim/geometry/contact_pairs.h"

namespace substep {
namespace {

thread_local Facets facets;

/// The search for the axis of contact of two revolved solids, and the contacts along it. The separation along
/// n, from b to a, is the height of a's lowest point above b's highest.
class RevolvedPair {
 public:
  RevolvedPair(const RevolvedSolid& a, const RevolvedSolid& b, double margin, Contacts& out)
      : a_(a), b_(b), size_(2 * std::min(a.reach(), b.reach())), margin_(margin), out_(out) {}

  void find() {
    if (!search_discs()) return;
    if (!consider_closest_axes() || !consider_balls(a_, b_, -1) || !consider_balls(b_, a_, 1)) return;
    if (!search_side(a_, -1) || !search_side(b_, 1)) return;
    if (!a_.is_ball_ended && !b_.is_ball_ended && !search_rims()) return;
    add_contacts();
  }

 private:
  double separation(const Vector3& n) const { return -a_.height(-n) - b_.height(n); }
  double preference(double value) const { return face_preference(value, size_); }

  /// Measures a direction. Returns false where the solids are separate by the margin along it, as do the
  /// searches below.
  bool consider(const Vector3& n) {
    const double value = separation(n);
    if (value > best_) {
      best_ = value;
      normal_ = n;
    }
    return value < margin_;
  }

  /// Searches the discs' normals, which are preferred as faces are.
  bool search_discs() {
    for (const bool of_b : {true, false}) {
      const RevolvedSolid& solid = of_b ? b_ : a_;
      if (solid.is_ball_ended) continue;
      for (int end = 0; end < 2; ++end) {
        if (solid.radius[end] == 0) continue;
        const Vector3 outward = end == 0 ? Vector3(-solid.axis) : solid.axis;
        const Vector3 n = of_b ? outward : Vector3(-outward);
        const double value = separation(n);
        if (value >= margin_) return false;
        const double handicap =
            !of_b && disc_separation_ > -infinity ? second_face_preference(disc_separation_, size_) : 0;
        if (value <= disc_separation_ + handicap) continue;
        disc_separation_ = value;
        disc_normal_ = n;
        disc_of_b_ = of_b;
        disc_end_ = end;
      }
    }
    return true;
  }

  /// Searches the directions between the closest points of the axes and across both axes.
  bool consider_closest_axes() {
    const Segment of_a = {a_.end(0), a_.end(1)};
    const Segment of_b = {b_.end(0), b_.end(1)};
    const SegmentParameters parameters = closest_parameters(of_a, of_b);
    const Vector3 between = point_at(of_a, parameters.on_a) - point_at(of_b, parameters.on_b);
    if (between.norm() > flush_fraction * size_ && !consider(between.normalized())) return false;
    const Vector3 across = a_.axis.cross(b_.axis);
    if (across.norm() > 1e-6) {
      if (!consider(across.normalized()) || !consider(-across.normalized())) return false;
    }
    // Separate coincident axes sideways.
    return best_ > -infinity || (consider(a_.across) && consider(-a_.across));
  }

  /// Searches the directions from the other solid's closest points to the balls at a solid's ends; `sense`
  /// turns directions towards the solid into n.
  bool consider_balls(const RevolvedSolid& solid, const RevolvedSolid& other, double sense) {
    if (!solid.is_ball_ended) return true;
    for (int end = 0; end < 2; ++end) {
      const std::optional<Vector3> direction = other.direction_to(solid.end(end));
      if (direction && !consider(-sense * *direction)) return false;
    }
    return true;
  }

  /// Searches the directions outward of a solid's straight side, all around; `sense` turns them into n.
  bool search_side(const RevolvedSolid& solid, double sense) {
    if (!solid.has_side) return true;
    const Vector3 x = solid.across;
    const Vector3 z = x.cross(solid.axis);
    const double d = std::sqrt(0.5);
    const std::array<Vector3, 8> around = {x, d * (x + z), z, d * (z - x), -x, -d * (x + z), -z, d * (x - z)};
    for (std::size_t i = 0; i < 8; ++i) {
      const auto u_at = [&](double part) -> Vector3 {
        return ((1 - part) * around[i] + part * around[(i + 1) % 8]).normalized();
      };
      const auto n_at = [&](const Vector3& u) -> Vector3 {
        return sense * (solid.cosine * u + solid.sine * solid.axis);
      };
      // Derivative of the separation round the side.
      const auto slope = [&](double part) {
        const Vector3 u = u_at(part);
        const Vector3 n = n_at(u);
        return sense * u.cross(solid.axis).dot(a_.support(-n) - b_.support(n));
      };
      if (!(slope(0) > 0) || !(slope(1) < 0)) continue;
      if (!consider(n_at(u_at(find_root(slope))))) return false;
    }
    return true;
  }

  /// Searches the rims of both, uphill from the best direction so far and from that between the middles.
  bool search_rims() {
    const Vector3 between = a_.middle - b_.middle;
    const Vector3 direct = between.norm() > flush_fraction * size_ ? Vector3(between.normalized()) : normal_;
    const Vector3 best = disc_separation_ > best_ ? disc_normal_ : normal_;
    const Vector3 found = normal_;
    const std::array<Vector3, 7> starts = {
        direct, best + direct, found, direct + a_.axis, direct - a_.axis, direct + b_.axis, direct - b_.axis};
    // Start towards each disc too where the overlap is deep: there are several ways out over the rims.
    const std::size_t count = std::max(best_, disc_separation_) < -0.1 * size_ ? starts.size() : 3;
    for (std::size_t i = 0; i < count; ++i) {
      if (starts[i].norm() > 0.1 && !climb(starts[i].normalized())) return false;
    }
    return true;
  }

  /// Follows the separation of two rims uphill by Newton's method.
  bool climb(Vector3 n) {
    double value = separation(n);
    for (int step = 0; step < 30; ++step) {
      const Vector3 w = a_.support(-n) - b_.support(n);
      const Vector3 gradient = w - w.dot(n) * n;
      if (gradient.norm() <= 1e-12 * size_) break;
      // Add the second derivatives across n: −w·n of the sphere, and each rim's bend.
      const Vector3 e0 = n.unitOrthogonal();
      const Vector3 e1 = n.cross(e0);
      Eigen::Matrix2d bend = -value * Eigen::Matrix2d::Identity();
      for (const RevolvedSolid* solid : {&a_, &b_}) {
        const Vector3 direction = solid == &a_ ? Vector3(-n) : n;
        const Vector3 out = solid->outward(direction);
        const double length = out.norm();
        if (length < 1e-9) continue;
        const int end = direction.dot(solid->support(direction, 1) - solid->support(direction, 0)) > 0;
        const Vector3 tangent = solid->axis.cross(out) / length;
        const Eigen::Vector2d t(tangent.dot(e0), tangent.dot(e1));
        bend -= solid->radius[end] / length * t * t.transpose();
      }
      const Eigen::Vector2d slope(gradient.dot(e0), gradient.dot(e1));
      Eigen::Vector2d move = slope / std::max(size_, slope.norm());
      // Take Newton's step where the separation bends down both ways: elsewhere there is no maximum.
      if (bend(0, 0) < 0 && bend.determinant() > 1e-12 * size_ * size_) {
        move = Eigen::Vector2d(-bend(1, 1) * slope[0] + bend(0, 1) * slope[1],
                               bend(1, 0) * slope[0] - bend(0, 0) * slope[1]) /
               bend.determinant();
      }
      bool better = false;
      for (int halving = 0; halving < 10 && !better; ++halving, move /= 2) {
        const Vector3 next = (n + move[0] * e0 + move[1] * e1).normalized();
        const double there = separation(next);
        if (!(there > value + 1e-15 * size_)) continue;
        better = true;
        value = there;
        n = next;
      }
      if (!better) break;
    }
    return consider(n);
  }

  void add_contacts() {
    const bool edge_first = best_ > disc_separation_ + preference(disc_separation_);
    if (disc_separation_ > -infinity && !edge_first && add_disc_contacts()) return;
    const double near = preference(best_);
    const double flush = flush_fraction * size_;
    Manifold manifold(normal_, size_, margin_, out_);
    if (manifold.add_beside(line_or_point(a_, -normal_, near), line_or_point(b_, normal_, near), near) ||
        manifold.add_crossing(line_or_point(a_, -normal_, flush), line_or_point(b_, normal_, flush)))
      return;
    const Vector3& n = best_ > disc_separation_ ? normal_ : disc_normal_;
    Manifold(n, size_, margin_, out_).add_point(a_.support(-n), std::max(best_, disc_separation_));
  }

  bool add_disc_contacts() {
    Manifold manifold(disc_normal_, size_, margin_, out_);
    const Disc disc = end_disc(disc_of_b_ ? b_ : a_, disc_end_);
    if (disc_of_b_) {
      std::visit([&](const auto& feature) { manifold.add(feature, disc); },
                 feature_towards(a_, -disc_normal_));
    } else {
      std::visit([&](const auto& feature) { manifold.add(disc, feature); },
                 feature_towards(b_, disc_normal_));
    }
    return manifold.keep_if_below(disc_separation_ + preference(disc_separation_));
  }

  const RevolvedSolid& a_;
  const RevolvedSolid& b_;
  double size_;
  double margin_;
  Contacts& out_;
  double disc_separation_ = -infinity;
  Vector3 disc_normal_ = Vector3::Zero();
  bool disc_of_b_ = false;
  int disc_end_ = 0;
  double best_ = -infinity;
  Vector3 normal_ = Vector3::Zero();
};

}  // namespace

void find_revolved_plane(const RevolvedSolid& a, const Pose& plane, double margin, Contacts& out) {
  const Vector3 normal = plane.orientation * Vector3::UnitY();
  if (normal.dot(a.middle - plane.position) - a.reach() >= margin) return;
  Manifold manifold(normal, 2 * a.reach(), margin, out);
  const auto add = [&](const Vector3& point) {
    manifold.add_point(point, normal.dot(point - plane.position));
  };
  const RevolvedFeature feature = feature_towards(a, -normal);
  if (const auto* disc = std::get_if<Disc>(&feature)) {
    for (const Vector3& point : rim_points(*disc, normal)) add(point);
  } else if (a.has_side) {
    const auto& [from, to] = std::get<Segment>(feature);
    add(from);
    add(to);
  } else {
    add(a.support(-normal));
  }
}

void find_revolved_revolved(const RevolvedSolid& a, const RevolvedSolid& b, double margin, Contacts& out) {
  const double reach = a.reach() + b.reach() + margin;
  if ((a.middle - b.middle).squaredNorm() >= reach * reach) return;
  // Search about the middle of one, so that the digits do not depend on the pair's distance from the origin.
  const Vector3 origin = b.middle;
  RevolvedSolid near_a = a;
  RevolvedSolid near_b = b;
  near_a.middle -= origin;
  near_b.middle.setZero();
  const std::size_t first = out.size();
  RevolvedPair(near_a, near_b, margin, out).find();
  place({origin, Quaternion::Identity()}, first, out);
}

void find_round_polytope(const Shape& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                         double margin, Contacts& out) {
  // Search in the polytope's frame. Subtract first: the difference is exact where both are far from the
  // origin.
  const Quaternion back = pose_b.orientation.conjugate();
  const Pose local = {back * (pose_a.position - pose_b.position), back * pose_a.orientation};
  const RevolvedSolid solid = *as_revolved(a, local);
  const double reach = solid.reach() + b.bounding_radius + margin;
  if ((solid.middle - b.centre).squaredNorm() >= reach * reach) return;
  facets.load(b, Matrix3::Identity());
  const std::size_t first = out.size();
  find_revolved_facets(solid, facets, margin, out);
  place(pose_b, first, out);
}

}  // namespace substep
