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

/// A joint's anchor in one of its bodies.
struct Anchor {
  std::size_t joint = 0;
  int body = world_body;
  Vector3 position;  ///< in the body frame
};

/// Returns both anchors of each joint that holds its anchors together.
std::vector<Anchor> anchors_of(const Scene& scene) {
  std::vector<Anchor> anchors;
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    if (!holds_anchors_together(joint)) continue;
    anchors.push_back({i, joint.body_a, joint.frame_a.position});
    anchors.push_back({i, joint.body_b, joint.frame_b.position});
  }
  return anchors;
}

/// A point of the world that bodies hang on, and the largest distance from it that each joint's anchor can
/// reach, along the bodies between them; infinite for joints that do not hang on the point.
struct Hold {
  Vector3 point;
  std::vector<double> reach;  ///< of each of the scene's joints
};

Hold hold_of(const Scene& scene, std::span<const Anchor> anchors, const Anchor& fixed) {
  Hold hold{fixed.position, std::vector<double>(scene.joints.size(), infinity)};
  hold.reach[fixed.joint] = 0;
  // Step from joint to joint over the body that both hold, until nothing gets shorter.
  for (bool shorter = true; shorter;) {
    shorter = false;
    for (const Anchor& from : anchors) {
      for (const Anchor& to : anchors) {
        if (from.body == world_body || to.body != from.body) continue;
        const double reach = hold.reach[from.joint] + (to.position - from.position).norm();
        if (!(reach < hold.reach[to.joint])) continue;
        hold.reach[to.joint] = reach;
        shorter = true;
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

/// Returns a lower bound of the height of the part's corners as its body hangs on the world; −∞ without a
/// joint.
double lowest_hanging(const Part& part, std::span<const Anchor> anchors, std::span<const Hold> holds) {
  double lowest = infinity;
  for (const Vector3& corner : part.corners_at({})) {
    std::vector<std::pair<Vector3, double>> balls;
    for (const Hold& hold : holds) {
      double reach = infinity;
      for (const Anchor& anchor : anchors) {
        if (anchor.body != part.body) continue;
        reach = std::min(reach, hold.reach[anchor.joint] + (corner - anchor.position).norm());
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

/// A ring of eight cells around a cell: their offsets and the range of distances that they represent, all in
/// cells.
struct Ring {
  std::array<std::array<int, 2>, 8> offsets{};
  float near = 0;
  float far = 0;
};

/// Returns rings, each half as far again as the one before.
std::array<Ring, 11> rings_around_a_cell() {
  std::array<Ring, 11> rings;
  double near = 0.25;
  for (Ring& ring : rings) {
    const double far = near * 1.5;
    const double middle = (near + far) / 2;
    for (std::size_t direction = 0; direction < ring.offsets.size(); ++direction) {
      const SineCosine of = sine_cosine(2 * std::numbers::pi * (static_cast<double>(direction) + 0.3) / 8);
      ring.offsets[direction] = {static_cast<int>(std::lround(middle * of.cosine)),
                                 static_cast<int>(std::lround(middle * of.sine))};
    }
    ring.near = static_cast<float>(near);
    ring.far = static_cast<float>(far);
    near = far;
  }
  return rings;
}

/// Returns the fraction, in 32nds, of uniform skylight on level ground that comes from below the elevation of
/// `height` at `distance`: the square of its sine.
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

  const std::vector<Anchor> anchors = anchors_of(scene);
  std::vector<Hold> holds;
  for (const Anchor& anchor : anchors) {
    if (anchor.body == world_body) holds.push_back(hold_of(scene, anchors, anchor));
  }
  const std::vector<Coordinates> start = initial_state(scene).q;
  double of_world = infinity;
  double at_start = infinity;
  double lowest = infinity;
  double highest = -infinity;
  for (const Part& part : parts) {
    const Coordinates& q = start[part.body];
    double y = infinity;
    for (const Vector3& corner : part.corners_at(q)) y = std::min(y, corner.y());
    if (part.body == world_body) {
      of_world = std::min(of_world, y);
      continue;
    }
    const double hanging = lowest_hanging(part, anchors, holds);
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
  static const auto rings = rings_around_a_cell();
  constexpr int size = Relief::size;
  const auto cell = static_cast<float>(relief.width / size);
  std::vector<std::array<std::uint32_t, 8>> hidden(std::size_t{1} * size * size);
  for (int index = 0; index < size * size; ++index) {
    if (relief.highest[index] < 0) continue;
    for (const Ring& ring : rings) {
      const int from = thirty_seconds(relief.lowest[index], ring.far * cell);
      const int to = thirty_seconds(relief.highest[index], ring.near * cell);
      const std::uint64_t below_to = (std::uint64_t{1} << to) - 1;
      const std::uint64_t below_from = (std::uint64_t{1} << from) - 1;
      const auto bits = static_cast<std::uint32_t>(below_to & ~below_from);
      for (std::size_t direction = 0; bits != 0 && direction < ring.offsets.size(); ++direction) {
        const int x = index % size - ring.offsets[direction][0];
        const int z = index / size - ring.offsets[direction][1];
        if (x >= 0 && z >= 0 && x < size && z < size) hidden[z * size + x][direction] |= bits;
      }
    }
  }
  std::vector<float> openness;
  openness.reserve(hidden.size());
  for (const std::array<std::uint32_t, 8>& from : hidden) {
    int count = 0;
    // Most cells see all of the sky, and counting bits is a call where processors may lack the instruction.
    for (const std::uint32_t bits : from) count += bits != 0 ? std::popcount(bits) : 0;
    const float open = 1 - static_cast<float>(count) / (32.0F * 8);
    openness.push_back(ambient_floor + (1 - ambient_floor) * open);
  }
  return openness;
}

}  // namespace substep::render
