#include "render/player/pose_stream.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace substep::render {
namespace {

using Whole = std::array<std::int64_t, 7>;

void append(std::string& stream, std::int64_t change) {
  auto left = (static_cast<std::uint64_t>(change) << 1) ^ static_cast<std::uint64_t>(change >> 63);
  for (; left >= 128; left >>= 7) stream += static_cast<char>((left & 127) | 128);
  stream += static_cast<char>(left);
}

/// Returns the pose in whole units; numbers that are not finite stay as in `before`.
Whole whole(const Coordinates& q, double unit, const Whole& before) {
  constexpr double far = 1e5;
  Whole result = before;
  if (!q.linear.allFinite() || !q.angular.coeffs().allFinite()) return result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result[axis] = std::llround(std::clamp(q.linear[static_cast<int>(axis)], -far, far) / unit);
  }
  const Eigen::Vector4d turn = q.angular.coeffs();
  double same = 0;
  for (std::size_t i = 0; i < 4; ++i) same += turn[static_cast<int>(i)] * static_cast<double>(before[3 + i]);
  for (std::size_t i = 0; i < 4; ++i) {
    result[3 + i] = std::llround((same < 0 ? -1 : 1) * turn[static_cast<int>(i)] * turn_parts);
  }
  return result;
}

}  // namespace

double position_unit(double size) {
  return std::exp2(std::floor(std::log2(std::max(size, 1e-6) * 4e-6)));
}

std::string pose_stream(std::span<const std::vector<Coordinates>> frames, double unit) {
  std::string stream;
  if (frames.empty()) return stream;
  for (std::size_t body = 1; body < frames.front().size(); ++body) {
    std::vector<Whole> track;
    Whole before{};
    for (const std::vector<Coordinates>& frame : frames) {
      before = whole(frame[body], unit, before);
      track.push_back(before);
    }
    for (std::size_t i = 0; i < before.size(); ++i) {
      std::int64_t last = 0;
      for (const Whole& pose : track) {
        append(stream, pose[i] - last);
        last = pose[i];
      }
    }
  }
  return stream;
}

}  // namespace substep::render
