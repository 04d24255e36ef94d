#include "golden/compare/motion_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/measure/motion.h"

namespace substep::golden {
namespace {

/// Returns the change, with 0 for differences that rounding may cause: in each of the two tracks one step of
/// resolution and as much error.
BodyDifference beyond_rounding(BodyDifference change) {
  constexpr double least = 4 * Track::resolution;
  if (change.position <= least) change.position = 0;
  if (change.orientation <= least) change.orientation = 0;
  if (change.position == 0) change.axis = change.orientation > 0 ? 'r' : ' ';
  return change;
}

int frame_count(const LoggedMotion& golden, const LoggedMotion& actual) {
  return static_cast<int>(std::min(golden.log->frames.size(), actual.log->frames.size()));
}

std::string body_name(const LoggedMotion& motion, std::size_t body) {
  const auto& names = motion.log->bodies;
  return body < names.size() ? names[body] : fmt::format("body {}", body);
}

const Track::Frame* track_frame(const LoggedMotion& motion, int frame) {
  if (motion.track == nullptr || frame >= static_cast<int>(motion.track->frames.size())) return nullptr;
  return &motion.track->frames[static_cast<std::size_t>(frame)];
}

int first_changed_frame(const LoggedMotion& golden, const LoggedMotion& actual) {
  const auto& a = golden.log->frames;
  const auto& b = actual.log->frames;
  const auto other = std::ranges::mismatch(a, b, {}, &PoseLog::Frame::hash, &PoseLog::Frame::hash);
  return other.in1 == a.end() && other.in2 == b.end() ? -1 : static_cast<int>(other.in1 - a.begin());
}

/// Returns the bodies whose digests differ; none without tracks.
std::vector<std::size_t> changed_bodies(const LoggedMotion& golden, const LoggedMotion& actual, int frame) {
  std::vector<std::size_t> result;
  const Track::Frame* a = track_frame(golden, frame);
  const Track::Frame* b = track_frame(actual, frame);
  const bool is_known = a != nullptr && b != nullptr && a->digests.size() == b->digests.size();
  for (std::size_t i = 1; is_known && i < a->digests.size(); ++i)
    if (a->digests[i] != b->digests[i]) result.push_back(i);
  return result;
}

/// Returns the difference of two poses beyond what their rounding may cause.
BodyDifference difference_of(const PosePair& pair, std::size_t body) {
  const BodyDifference exact = difference(pair.golden[body], pair.actual[body]);
  return pair.is_rounded ? beyond_rounding(exact) : exact;
}

FirstChange first_change(const LoggedMotion& golden, const LoggedMotion& actual) {
  FirstChange first;
  first.frame = first_changed_frame(golden, actual);
  if (first.frame < 0) return first;
  std::vector<std::size_t> candidates = changed_bodies(golden, actual, first.frame);
  for (const std::size_t body : candidates) first.bodies.push_back(body_name(golden, body));
  if (!candidates.empty()) first.body = first.bodies.front();
  for (std::size_t i = 1; first.bodies.empty() && i < golden.log->bodies.size(); ++i) candidates.push_back(i);
  const int common = frame_count(golden, actual);
  for (int k = first.frame; k < common; ++k) {
    const PosePair pair = poses_at(golden, actual, k);
    BodyDifference largest;
    for (const std::size_t body : candidates) {
      if (body >= pair.golden.size() || body >= pair.actual.size()) continue;
      const BodyDifference change = difference_of(pair, body);
      if (change.axis == ' ' || !change.is_larger_than(largest)) continue;
      largest = change;
      first.body = body_name(golden, body);
    }
    first.axis = largest.axis;
    first.size = largest.size();
    first.size_frame = k;
    // Equal logged poses prove that only velocities differ; equal rounded poses prove nothing.
    const bool is_decided = largest.axis != ' ' || (!pair.golden.empty() && !pair.is_rounded);
    if (is_decided) return first;
  }
  first.size_frame = -1;
  return first;
}

int first_different_contacts(const LoggedMotion& golden, const LoggedMotion& actual, int from) {
  for (int k = std::max(from, 0); k < frame_count(golden, actual); ++k) {
    const Track::Frame* a = track_frame(golden, k);
    const Track::Frame* b = track_frame(actual, k);
    if (a == nullptr || b == nullptr) return -1;
    if (a->invariants.touching != b->invariants.touching) return k;
  }
  return -1;
}

/// Returns a message on the first body of a frame that differs by more than `tolerance`; empty: none does.
std::string poses_beyond(const LoggedMotion& golden, const LoggedMotion& actual, int frame,
                         const PoseTolerance& tolerance) {
  const PosePair pair = poses_at(golden, actual, frame);
  for (std::size_t i = 1; i < std::min(pair.golden.size(), pair.actual.size()); ++i) {
    const BodyDifference change = difference_of(pair, i);
    if (change.position > tolerance.position) {
      return fmt::format("body {} position {} {:.2g} m (limit {:g})", body_name(golden, i), change.axis,
                         change.position, tolerance.position);
    }
    if (change.orientation > tolerance.orientation) {
      return fmt::format("body {} orientation {:.2g} rad (limit {:g})", body_name(golden, i),
                         change.orientation, tolerance.orientation);
    }
  }
  return {};
}

std::string invariants_beyond(const Invariants& golden, const Invariants& actual, double energy_scale,
                              const PoseTolerance& tolerance) {
  const double energy = std::abs(actual.energy - golden.energy);
  if (energy > tolerance.energy * energy_scale) {
    return fmt::format("energy {:.4g} J, golden {:.4g} J (limit {:g} of {:.4g} J)", actual.energy,
                       golden.energy, tolerance.energy, energy_scale);
  }
  if (actual.penetration > golden.penetration + tolerance.penetration) {
    return fmt::format("penetration {:.2g} m, golden {:.2g} m (limit {:g} more)", actual.penetration,
                       golden.penetration, tolerance.penetration);
  }
  if (std::abs(actual.resting - golden.resting) > tolerance.resting) {
    return fmt::format("{} bodies rest, golden {} (limit {})", actual.resting, golden.resting,
                       tolerance.resting);
  }
  return {};
}

/// Returns the largest energy of a golden run, J. A body's height counts from its lowest one in the run less
/// the diagonal of the scene's smallest body, so that the origin has no influence, and bodies at rest have
/// some energy.
double energy_scale_of(const Track& golden, const Scene& scene) {
  double lowest = 0;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    const Vector3 pull = body.gravity_factor * scene.gravity;
    double potential = infinity;
    for (const Track::Frame& frame : golden.frames)
      if (i < frame.poses.size()) potential = std::min(potential, -pull.dot(frame.poses[i].linear));
    if (body.inverse_mass > 0 && std::isfinite(potential))
      lowest += (potential - pull.norm() * smallest_body_of(scene)) / body.inverse_mass;
  }
  double scale = 0;
  for (const Track::Frame& frame : golden.frames) scale = std::max(scale, frame.invariants.energy - lowest);
  return scale;
}

void judge(const LoggedMotion& golden, const LoggedMotion& actual, const Scene& scene,
           const PoseTolerance& tolerance, MotionComparison& result) {
  if (golden.log->frames.size() != actual.log->frames.size() || golden.log->end != actual.log->end) {
    result.judgement = PoseJudgement::end;
    return;
  }
  const double energy_scale = golden.track == nullptr ? 0 : energy_scale_of(*golden.track, scene);
  result.judgement = PoseJudgement::within;
  for (int k = result.first.frame; k < frame_count(golden, actual); ++k) {
    const bool by_poses = result.contacts_frame < 0 || k < result.contacts_frame;
    result.limit = by_poses ? poses_beyond(golden, actual, k, tolerance)
                            : invariants_beyond(track_frame(golden, k)->invariants,
                                                track_frame(actual, k)->invariants, energy_scale, tolerance);
    if (result.limit.empty()) continue;
    result.judgement = by_poses ? PoseJudgement::poses : PoseJudgement::invariants;
    result.limit_frame = k;
    return;
  }
}

}  // namespace

std::string_view name(PoseJudgement judgement) {
  constexpr std::array<std::string_view, 6> names{"exact", "within tolerance", "not exact", "end",
                                                  "poses", "invariants"};
  return names[static_cast<std::size_t>(judgement)];
}

PosePair poses_at(const LoggedMotion& golden, const LoggedMotion& actual, int frame) {
  const auto k = static_cast<std::size_t>(frame);
  if (k < golden.log->frames.size() && k < actual.log->frames.size()) {
    const auto& a = golden.log->frames[k].poses;
    const auto& b = actual.log->frames[k].poses;
    if (!a.empty() && !b.empty()) return {a, b, false};
  }
  const Track::Frame* a = track_frame(golden, frame);
  const Track::Frame* b = track_frame(actual, frame);
  if (a == nullptr || b == nullptr) return {};
  return {a->poses, b->poses, true};
}

MotionComparison compare_motion(const LoggedMotion& golden, const LoggedMotion& actual, const Scene& scene,
                                const std::optional<PoseTolerance>& tolerance) {
  MotionComparison result;
  result.first = first_change(golden, actual);
  if (result.first.frame < 0) return result;
  result.contacts_frame = first_different_contacts(golden, actual, result.first.frame);
  if (tolerance) {
    judge(golden, actual, scene, *tolerance, result);
  } else {
    result.judgement = PoseJudgement::not_exact;
  }
  return result;
}

}  // namespace substep::golden
