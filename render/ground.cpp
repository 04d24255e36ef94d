#include "render/ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace substep {
namespace {

double lowest_point(const Part& part, const Coordinates& q) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vector3& corner : part.corners()) lowest = std::min(lowest, (q.angular * corner + q.linear).y());
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

double ground_height(const Scene& scene, std::span<const Part> parts,
                     std::span<const std::vector<Coordinates>> frames) {
  double plane = -std::numeric_limits<double>::infinity();
  for (const Collider& collider : scene.colliders) {
    if (is_ground(collider)) plane = std::max(plane, collider.placement.position.y());
  }
  if (std::isfinite(plane)) return plane;

  double of_world = std::numeric_limits<double>::infinity();
  double lowest = of_world;
  double highest = -of_world;
  for (const Part& part : parts) {
    const auto body = static_cast<std::size_t>(part.body);
    if (part.body == world_body) of_world = std::min(of_world, lowest_point(part, Coordinates{}));
    for (const std::vector<Coordinates>& frame : frames) {
      const double y = lowest_point(part, frame[body]);
      if (!(std::abs(y) < 1000)) continue;
      lowest = std::min(lowest, y);
      highest = std::max(highest, frame[body].linear.y());
      if (part.body == world_body) break;
    }
  }
  if (!std::isfinite(lowest)) return 0;
  // What falls out of the scene does not take the ground along.
  const double first = [&] {
    double y = highest;
    for (const Part& part : parts) {
      y = std::min(y, lowest_point(part, frames.front()[static_cast<std::size_t>(part.body)]));
    }
    return y;
  }();
  const double extent = std::max(highest - first, 0.1);
  if (lowest < first - 3 * extent) lowest = first;
  if (of_world <= lowest) return of_world;
  return lowest - 0.2 * (highest - lowest);
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
