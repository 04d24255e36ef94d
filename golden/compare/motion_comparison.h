#pragma once
/// Compares two runs of a scene: the first difference, and whether a tolerance holds.
///
/// The order of judgement; the first rule that applies decides, and a run that passes 3 to 5 is `within`:
///
///  1. exact       every frame has the golden hash (case_check.cpp compares the poses, too);
///  2. not exact   without a tolerance any difference fails: the rule for our own scenes;
///  3. end         the runs must have equally many frames and end alike;
///  4. poses       until the pairs of bodies that touch first differ (without tracks: in every frame), every
///                 body must be within `position` and `orientation` of the golden one;
///  5. invariants  from there on contacts multiply the smallest difference, so poses may differ; but energy,
///                 penetration (where deeper than the golden) and the number of resting bodies must agree.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "golden/compare/track.h"
#include "sim/log/pose_log.h"

namespace substep::golden {

struct PoseTolerance {
  double position = 1e-4;     ///< m
  double orientation = 1e-3;  ///< rad
  double energy = 0.02;       ///< fraction of the golden run's largest energy above each body's lowest height
  double penetration = 1e-3;  ///< m, beyond the golden run's
  int resting = 1;            ///< bodies
};

enum class PoseJudgement { exact, within, not_exact, end, poses, invariants };

std::string_view name(PoseJudgement judgement);

inline bool passes(PoseJudgement judgement) {
  return judgement == PoseJudgement::exact || judgement == PoseJudgement::within;
}

/// A pose log and, where there is one, its track.
struct LoggedMotion {
  const PoseLog* log = nullptr;
  const Track* track = nullptr;
};

/// The poses of both at a frame: as logged when both logs have them, else both from the tracks; empty when
/// there are none.
struct PosePair {
  std::span<const Coordinates> golden;
  std::span<const Coordinates> actual;
  bool is_rounded = false;  ///< to Track::resolution
};
PosePair poses_at(const LoggedMotion& golden, const LoggedMotion& actual, int frame);

/// The first difference of two runs.
struct FirstChange {
  int frame = -1;                   ///< first with another state, −1: none
  std::vector<std::string> bodies;  ///< those whose state changed in it; empty: not known without a track
  std::string body;     ///< the one of `bodies`, or of all if empty, that differs most at `size_frame`
  char axis = ' ';      ///< 'x' 'y' 'z' of its position, 'r' orientation, ' ' only velocities, or not known
  double size = 0;      ///< m, or rad for 'r'
  int size_frame = -1;  ///< of this measurement: `frame`, or the next with other poses; −1: not known
};

struct MotionComparison {
  PoseJudgement judgement = PoseJudgement::exact;
  FirstChange first;
  int contacts_frame = -1;  ///< first whose touching pairs differ; −1: none, or not known
  int limit_frame = -1;     ///< first beyond the tolerance, by poses or invariants
  std::string limit;        ///< the value beyond it: "body crate position x 0.0012 m (limit 0.0001)"
};

/// Compares two runs of `scene`.
MotionComparison compare_motion(const LoggedMotion& golden, const LoggedMotion& actual, const Scene& scene,
                                const std::optional<PoseTolerance>& tolerance);

}  // namespace substep::golden
