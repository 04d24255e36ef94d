/// Comparison of pose logs.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/log/pose_log.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

std::string header_differences(const PoseLog& expected, const PoseLog& actual) {
  std::string result;
  const auto line = [&result](std::string_view what, const auto& a, const auto& b) {
    if (a != b) result += fmt::format("{}: {} → {}\n", what, a, b);
  };
  line("scene", expected.scene, actual.scene);
  line("scene-hash", fmt::format("{:016x}", expected.scene_hash), fmt::format("{:016x}", actual.scene_hash));
  line("author", expected.author, actual.author);
  for (const SettingsField& field : settings_fields) {
    if (!expected.has_setting(field.name) || !actual.has_setting(field.name)) continue;
    line(field.name, text_of(expected.settings, field), text_of(actual.settings, field));
  }
  line("modelled", expected.modelled, actual.modelled);
  line("bodies", expected.bodies.size() - 1, actual.bodies.size() - 1);
  const std::size_t bodies = std::min(expected.bodies.size(), actual.bodies.size());
  for (std::size_t i = 0; i < bodies; ++i) {
    line(fmt::format("body {}", i), expected.bodies[i], actual.bodies[i]);
  }
  line("full-every", expected.full_every, actual.full_every);
  line("last frame", expected.frames.size() - 1, actual.frames.size() - 1);
  line("end", expected.end, actual.end);
  if (!result.empty()) result.pop_back();
  return result;
}

bool same_poses(const PoseLog::Frame& a, const PoseLog::Frame& b) {
  const std::size_t bodies = std::min(a.poses.size(), b.poses.size());
  for (std::size_t i = 1; i < bodies; ++i) {
    if (a.poses[i].linear != b.poses[i].linear) return false;
    if (a.poses[i].angular.coeffs() != b.poses[i].angular.coeffs()) return false;
  }
  return true;
}

}  // namespace

BodyDifference difference(const Coordinates& a, const Coordinates& b) {
  BodyDifference result;
  const Vector3 offset = (a.linear - b.linear).cwiseAbs();
  Eigen::Index axis = 0;
  result.position = offset.maxCoeff(&axis);
  // Take the angle from the vector part, which keeps the digits of a small angle.
  const Quaternion between = a.angular.conjugate() * b.angular;
  result.orientation = 2 * std::atan2(between.vec().norm(), std::abs(between.w()));
  if (a.angular.coeffs() == b.angular.coeffs() || a.angular.coeffs() == -b.angular.coeffs()) {
    result.orientation = 0;
  }
  if (result.position > 0) {
    result.axis = "xyz"[axis];
  } else if (result.orientation > 0) {
    result.axis = 'r';
  }
  return result;
}

PoseDifference compare(const PoseLog& expected, const PoseLog& actual) {
  PoseDifference result;
  BodyDifference largest;  // in the first full frame
  result.headers = header_differences(expected, actual);
  const std::size_t common = std::min(expected.frames.size(), actual.frames.size());
  for (std::size_t k = 0; k < common; ++k) {
    const PoseLog::Frame& a = expected.frames[k];
    const PoseLog::Frame& b = actual.frames[k];
    if (result.first_frame < 0 && a.hash != b.hash) result.first_frame = static_cast<int>(k);
    if (result.first_contradiction < 0 && a.hash == b.hash && !same_poses(a, b)) {
      result.first_contradiction = static_cast<int>(k);
    }
    const std::size_t bodies = std::min(a.poses.size(), b.poses.size());
    const bool first_full = result.first_frame >= 0 && result.first_full_frame < 0 && bodies > 0;
    if (first_full) result.first_full_frame = static_cast<int>(k);
    for (std::size_t body = 1; body < bodies; ++body) {
      const BodyDifference found = difference(a.poses[body], b.poses[body]);
      result.largest_position = std::max(result.largest_position, found.position);
      result.largest_orientation = std::max(result.largest_orientation, found.orientation);
      if (first_full && found.is_larger_than(largest)) {
        largest = found;
        result.body = static_cast<int>(body);
      }
    }
  }
  result.axis = largest.axis;
  result.size = largest.size();
  if (result.first_frame < 0 && expected.frames.size() != actual.frames.size()) {
    result.first_frame = static_cast<int>(common);
  }
  return result;
}

}  // namespace substep
