#include "render/ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace substep {
namespace {

double lowest_point(const Part& part, const Coordinates& q) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vector3& corner : part.corners()) lowest = std::min(lowest, (q.angular * corner + q.linear).y());
  return lowest;
}

/// Whether the joint keeps its two anchors together.
bool holds_anchors(const Joint& joint) {
  std::array<bool, 3> held{};
  for (const JointLimit& limit : joint.limits) {
    if (limit.angular || limit.min != 0 || limit.max != 0 || limit.stiffness) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) held[axis] = held[axis] || limit.axes[axis];
  }
  return held[0] && held[1] && held[2];
}

/// A point of the world that bodies hang on, and how far from it each joint's anchor can get at most: along
/// the bodies between them. Infinite where nothing holds it to the point.
struct Hold {
  Vector3 point;
  std::vector<double> reach;  ///< of each of the scene's joints
};

Hold hold_of(const Scene& scene, std::size_t fixed) {
  const Joint& first = scene.joints[fixed];
  Hold hold;
  hold.point = first.body_a == world_body ? first.frame_a.position : first.frame_b.position;
  hold.reach.assign(scene.joints.size(), std::numeric_limits<double>::infinity());
  hold.reach[fixed] = 0;
  // From joint to joint over the body that both hold, until nothing gets shorter.
  for (bool shorter = true; shorter;) {
    shorter = false;
    for (std::size_t from = 0; from < scene.joints.size(); ++from) {
      const Joint& a = scene.joints[from];
      for (std::size_t to = 0; std::isfinite(hold.reach[from]) && to < scene.joints.size(); ++to) {
        const Joint& b = scene.joints[to];
        if (!holds_anchors(b)) continue;
        for (const auto& [body, here] : {std::pair(a.body_a, a.frame_a), std::pair(a.body_b, a.frame_b)}) {
          if (body == world_body || (b.body_a != body && b.body_b != body)) continue;
          const Pose& there = b.body_a == body ? b.frame_a : b.frame_b;
          const double reach = hold.reach[from] + (there.position - here.position).norm();
          if (reach < hold.reach[to]) {
            hold.reach[to] = reach;
            shorter = true;
          }
        }
      }
    }
  }
  return hold;
}

/// The lowest that a point can be which is at most `a` from `p` and at most `b` from `q`.
double lowest_within(const Vector3& p, double a, const Vector3& q, double b) {
  const Vector3 between = q - p;
  const double apart = between.norm();
  const Vector3 below_p = p - a * Vector3::UnitY();
  const Vector3 below_q = q - b * Vector3::UnitY();
  if ((below_p - q).norm() <= b) return below_p.y();
  if ((below_q - p).norm() <= a) return below_q.y();
  // On the circle in which the two balls' surfaces meet; where they do not, on the line between them.
  const double along = std::clamp((a * a - b * b + apart * apart) / (2 * apart), 0.0, apart);
  const double radius = std::sqrt(std::max(a * a - along * along, 0.0));
  const double upright = between.y() / apart;
  return p.y() + along * upright - radius * std::sqrt(std::max(1 - upright * upright, 0.0));
}

/// The lowest that the part's corners can get as its body hangs on the world; −∞ where nothing holds it.
double lowest_hanging(const Scene& scene, const Part& part, std::span<const Hold> holds) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vector3& corner : part.corners()) {
    std::vector<std::pair<Vector3, double>> balls;
    for (const Hold& hold : holds) {
      double reach = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < scene.joints.size(); ++i) {
        const Joint& joint = scene.joints[i];
        for (const auto& [body, frame] :
             {std::pair(joint.body_a, joint.frame_a), std::pair(joint.body_b, joint.frame_b)}) {
          if (body == part.body) reach = std::min(reach, hold.reach[i] + (corner - frame.position).norm());
        }
      }
      if (std::isfinite(reach)) balls.emplace_back(hold.point, reach);
    }
    double bound = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < balls.size(); ++i) {
      bound = std::max(bound, balls[i].first.y() - balls[i].second);
      for (std::size_t j = 0; j < i; ++j) {
        bound =
            std::max(bound, lowest_within(balls[i].first, balls[i].second, balls[j].first, balls[j].second));
      }
    }
    lowest = std::min(lowest, bound);
  }
  return lowest;
}

/// A ball of the row that stands for a part, in the body frame.
struct Ball {
  Vector3 centre;
  double radius;
};

/// Balls along the part's box, as wide as its middle side and at most nine.
std::vector<Ball> balls_of(const Part& part) {
  const Vector3 half = part.half_size();
  Eigen::Index longest = 0;
  half.maxCoeff(&longest);
  const double wide = std::max(half[(longest + 1) % 3], half[(longest + 2) % 3]);
  const double thin = std::min(half[(longest + 1) % 3], half[(longest + 2) % 3]);
  const double radius = std::max(std::sqrt(wide * thin) * 1.1, half[longest] / 9);
  const int count = std::clamp(static_cast<int>(std::lround(half[longest] / std::max(radius, 1e-9))), 1, 9);
  std::vector<Ball> balls;
  for (int i = 0; i < count; ++i) {
    Ball ball{part.centre(), radius};
    ball.centre[longest] += (2.0 * i + 1 - count) / count * half[longest];
    balls.push_back(ball);
  }
  return balls;
}

}  // namespace

double ground_height(const Scene& scene, std::span<const Part> parts) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  double plane = -infinite;
  for (const Collider& collider : scene.colliders) {
    if (is_ground(collider)) plane = std::max(plane, collider.placement.position.y());
  }
  if (std::isfinite(plane)) return plane;

  std::vector<Hold> holds;
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    const bool is_fixed = (joint.body_a == world_body) != (joint.body_b == world_body);
    if (is_fixed && holds_anchors(joint)) holds.push_back(hold_of(scene, i));
  }
  const std::vector<Coordinates> start = initial_state(scene).q;
  double of_world = infinite;
  double at_start = infinite;
  double lowest = infinite;
  double highest = -infinite;
  for (const Part& part : parts) {
    const Coordinates& q = start[static_cast<std::size_t>(part.body)];
    const double y = lowest_point(part, q);
    if (part.body == world_body) {
      of_world = std::min(of_world, y);
      continue;
    }
    const double hanging = lowest_hanging(scene, part, holds);
    at_start = std::min(at_start, y);
    lowest = std::min({lowest, y, std::isfinite(hanging) ? hanging : y});
    highest = std::max(highest, q.linear.y());
  }
  if (of_world <= at_start) return std::isfinite(of_world) ? of_world : 0;
  return lowest - 0.2 * std::max(highest - lowest, 0.1);
}

GroundOcclusion ground_occlusion(std::span<const Part> parts, std::span<const Coordinates> poses,
                                 double height, double low_x, double low_z, double width) {
  GroundOcclusion map;
  map.corner_x = low_x;
  map.corner_z = low_z;
  map.width = width;
  constexpr int size = GroundOcclusion::size;
  map.openness.assign(static_cast<std::size_t>(size) * size, 1.0F);
  const double cell = width / size;
  for (const Part& part : parts) {
    if (is_scenery(part, parts)) continue;
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    for (const Ball& ball : balls_of(part)) {
      const Vector3 centre = q.angular * ball.centre + q.linear;
      const double above = std::max(centre.y() - height, 0.0);
      // A ball hides the cosine-weighted part r² cos / d² of the sky; beyond `reach` that is under 1 %.
      const double reach = 5 * ball.radius;
      if (!(above < reach)) continue;
      const auto cells = [&](double from, double corner) {
        return static_cast<int>(std::clamp((from - corner) / cell, 0.0, static_cast<double>(size)));
      };
      const int first_row = cells(centre.z() - reach, low_z);
      const int last_row = cells(centre.z() + reach, low_z);
      const int first_column = cells(centre.x() - reach, low_x);
      const int last_column = cells(centre.x() + reach, low_x);
      const auto strength = static_cast<float>(ball.radius * ball.radius * above);
      for (int row = first_row; row < last_row; ++row) {
        const auto dz = static_cast<float>(low_z + (row + 0.5) * cell - centre.z());
        float* open = &map.openness[static_cast<std::size_t>(row) * size];
        const auto high_squared = static_cast<float>(above * above) + dz * dz;
        for (int column = first_column; column < last_column; ++column) {
          const auto dx = static_cast<float>(low_x + (column + 0.5) * cell - centre.x());
          const float squared = std::max(high_squared + dx * dx, 1e-12F);
          const float hidden = std::min(strength / (squared * std::sqrt(squared)), 0.9F);
          open[column] *= 1 - hidden;
        }
      }
    }
  }
  return map;
}

}  // namespace substep
