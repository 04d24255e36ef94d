#include "render/ground.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "sim/math/rotation.h"
#include "sim/model/model.h"

namespace substep::render {
namespace {

double lowest_point(const Part& part, const Coordinates& q) {
  double lowest = infinity;
  for (const Vector3& corner : part.corners_at(q)) lowest = std::min(lowest, corner.y());
  return lowest;
}

/// A point of the world that bodies hang on, and the largest distance from it that each joint's anchor can
/// reach, along the bodies between them; infinite for joints that do not hang on the point.
struct Hold {
  Vector3 point;
  std::vector<double> reach;  ///< of each of the scene's joints
};

Hold hold_of(const Scene& scene, std::size_t fixed) {
  const Joint& first = scene.joints[fixed];
  Hold hold;
  hold.point = first.body_a == world_body ? first.frame_a.position : first.frame_b.position;
  hold.reach.assign(scene.joints.size(), infinity);
  hold.reach[fixed] = 0;
  // Step from joint to joint over the body that both hold, until nothing gets shorter.
  for (bool shorter = true; shorter;) {
    shorter = false;
    for (std::size_t from = 0; from < scene.joints.size(); ++from) {
      const Joint& a = scene.joints[from];
      for (std::size_t to = 0; std::isfinite(hold.reach[from]) && to < scene.joints.size(); ++to) {
        const Joint& b = scene.joints[to];
        if (!holds_anchors_together(b)) continue;
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

/// Returns the lowest that a point can be which is at most `a` from `p` and at most `b` from `q`.
double lowest_within(const Vector3& p, double a, const Vector3& q, double b) {
  const Vector3 between = q - p;
  const double distance = between.norm();
  const Vector3 below_p = p - a * Vector3::UnitY();
  const Vector3 below_q = q - b * Vector3::UnitY();
  if ((below_p - q).norm() <= b) return below_p.y();
  if ((below_q - p).norm() <= a) return below_q.y();
  // Take the lowest point of the circle in which the two balls' surfaces meet; where they do not, one on the
  // line between them.
  const double along = std::clamp((a * a - b * b + distance * distance) / (2 * distance), 0.0, distance);
  const double radius = std::sqrt(std::max(a * a - along * along, 0.0));
  const double upright = between.y() / distance;
  return p.y() + along * upright - radius * std::sqrt(std::max(1 - upright * upright, 0.0));
}

/// Returns the lowest height that the part's corners can reach as its body hangs on the world; −∞ without a
/// joint.
double lowest_hanging(const Scene& scene, const Part& part, std::span<const Hold> holds) {
  double lowest = infinity;
  for (const Vector3& corner : part.corners_at({})) {
    std::vector<std::pair<Vector3, double>> balls;
    for (const Hold& hold : holds) {
      double reach = infinity;
      for (std::size_t i = 0; i < scene.joints.size(); ++i) {
        const Joint& joint = scene.joints[i];
        for (const auto& [body, frame] :
             {std::pair(joint.body_a, joint.frame_a), std::pair(joint.body_b, joint.frame_b)}) {
          if (body == part.body) reach = std::min(reach, hold.reach[i] + (corner - frame.position).norm());
        }
      }
      if (std::isfinite(reach)) balls.emplace_back(hold.point, reach);
    }
    double bound = -infinity;
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

/// A step from a cell in one direction: its offset in cells, and the distances between which it stands for
/// the direction, in cells.
struct Step {
  int x = 0;
  int z = 0;
  float near = 0;
  float far = 0;
};

/// Returns steps in eight directions, each half as far again as the one before.
std::array<std::array<Step, 11>, 8> steps_from_a_cell() {
  std::array<std::array<Step, 11>, 8> steps;
  for (std::size_t direction = 0; direction < steps.size(); ++direction) {
    const SineCosine of = sine_cosine(2 * std::numbers::pi * (static_cast<double>(direction) + 0.3) / 8);
    double near = 0.25;
    for (Step& step : steps[direction]) {
      const double far = near * 1.5;
      const double middle = (near + far) / 2;
      step = {static_cast<int>(std::lround(middle * of.cosine)),
              static_cast<int>(std::lround(middle * of.sine)), static_cast<float>(near),
              static_cast<float>(far)};
      near = far;
    }
  }
  return steps;
}

/// Returns the fraction, in 32nds, of light evenly from all sides that level ground receives from below a
/// slope height / distance: the square of its sine.
int thirty_seconds(float height, float distance) {
  const float squared = height * height;
  return static_cast<int>(std::lround(32 * squared / (squared + distance * distance)));
}

}  // namespace

double ground_height(const Scene& scene, std::span<const Part> parts) {
  double plane = -infinity;
  for (const Collider& collider : scene.colliders) {
    if (is_ground(collider)) plane = std::max(plane, collider.placement.position.y());
  }
  if (std::isfinite(plane)) return plane;

  std::vector<Hold> holds;
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    const bool is_fixed = (joint.body_a == world_body) != (joint.body_b == world_body);
    if (is_fixed && holds_anchors_together(joint)) holds.push_back(hold_of(scene, i));
  }
  const std::vector<Coordinates> start = initial_state(scene).q;
  double of_world = infinity;
  double at_start = infinity;
  double lowest = infinity;
  double highest = -infinity;
  for (const Part& part : parts) {
    const Coordinates& q = start[part.body];
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

std::vector<float> ground_openness(const Relief& relief) {
  // Visibility by bitmask (Therrien, Levesque and Gilet 2023), over a map from above instead of over the
  // screen: a bit is a 32nd of the light of one direction. Few cells have anything above them: each marks the
  // cells that it hides the sky from.
  static const auto steps = steps_from_a_cell();
  constexpr int size = Relief::size;
  const auto cell = static_cast<float>(relief.width / size);
  std::vector<std::array<std::uint32_t, 8>> hidden(std::size_t{1} * size * size);
  for (int index = 0; index < size * size; ++index) {
    if (relief.highest[index] < 0) continue;
    for (std::size_t i = 0; i < steps[0].size(); ++i) {
      const int from = thirty_seconds(relief.lowest[index], steps[0][i].far * cell);
      const int to = thirty_seconds(relief.highest[index], steps[0][i].near * cell);
      const std::uint64_t below_to = (std::uint64_t{1} << to) - 1;
      const std::uint64_t below_from = (std::uint64_t{1} << from) - 1;
      const auto bits = static_cast<std::uint32_t>(below_to & ~below_from);
      for (std::size_t direction = 0; bits != 0 && direction < steps.size(); ++direction) {
        const int x = index % size - steps[direction][i].x;
        const int z = index / size - steps[direction][i].z;
        if (x >= 0 && z >= 0 && x < size && z < size) hidden[z * size + x][direction] |= bits;
      }
    }
  }
  std::vector<float> openness;
  openness.reserve(hidden.size());
  for (const std::array<std::uint32_t, 8>& from : hidden) {
    int count = 0;
    // Most cells see all of the sky, and counting bits is a call where processors may lack the instruction.
    for (std::size_t i = 0; i < from.size(); i += 2) {
      const std::uint64_t two = from[i] | std::uint64_t{from[i + 1]} << 32;
      if (two != 0) count += std::popcount(two);
    }
    const float open = 1 - static_cast<float>(count) / (32.0F * 8);
    openness.push_back(ambient_floor + (1 - ambient_floor) * open);
  }
  return openness;
}

}  // namespace substep::render
