#include "golden/check/case_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "golden/check/case_images.h"
#include "golden/check/case_offers.h"
#include "golden/check/case_work.h"
#include "sim/simulation.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::string line;
  for (const char c : text) line += c == '\n' ? std::string("; ") : std::string(1, c);
  return line;
}

/// A track is written with its poses; by hand or by an older program they can come apart.
bool has_own_track(CaseWork& work) {
  if (!work.golden_track) return false;
  if (!work.live || work.result.poses.motion.judgement != PoseJudgement::exact) return true;
  const bool is_own = to_bytes(*work.golden_track) == to_bytes(*work.live_track);
  if (!is_own) work.note("its track is of another run than its poses: approve it by name to renew it");
  return is_own;
}

void check_poses(CaseWork& work) {
  PoseResult& poses = work.result.poses;
  poses.is_checked = true;
  const Settings& settings = work.result.entry.settings;
  Simulation simulation(work.scene, settings);
  Tracker tracker(work.scene, settings);
  tracker.add(simulation.state());
  work.live = record(simulation, work.result.entry.frames, work.result.entry.full_every,
                     [&](int, const StepReport&) { tracker.add(simulation.state()); });
  work.live_track = tracker.take();
  poses.frames = static_cast<int>(work.live->frames.size());
  poses.end = work.live->end;
  if (!work.golden) return;
  poses.golden_frames = static_cast<int>(work.golden->frames.size());
  poses.difference = compare(*work.golden, *work.live);
  const PoseDifference& difference = poses.difference;
  const bool same_poses = difference.largest_position == 0 && difference.largest_orientation == 0;
  if (difference.first_frame >= 0) {
    poses.motion = compare_motion(work.golden_motion(), work.live_motion(),
                                  viewfinder(work.scene, work.result.entry, *work.golden),
                                  work.result.entry.pose_tolerance);
  } else if (!same_poses) {
    poses.motion.judgement = PoseJudgement::differs;
    work.note("the golden log's poses are not those that its hashes are of: it was edited");
  }
  poses.passes = passes(poses.motion.judgement);
  if (poses.motion.judgement == PoseJudgement::within) {
    work.note(fmt::format("poses differ from frame {} on, within the case's pose tolerance",
                          poses.motion.first.frame));
  }
  if (poses.motion.judgement == PoseJudgement::exact && !difference.headers.empty()) {
    work.note("same states, but other headers: " + one_line(difference.headers));
  }
}

void decide(CaseWork& work) {
  const PoseResult& poses = work.result.poses;
  const auto& images = work.result.images;
  const auto none_of = [&](auto&& is) { return std::none_of(images.begin(), images.end(), is); };
  const bool no_image = none_of([](const auto& i) { return i.has_golden; });
  const bool every_image = none_of([](const auto& i) { return !i.has_golden; });
  const bool poses_fail = poses.is_checked && !poses.passes;
  const bool images_fail = !none_of([](const auto& i) { return i.is_drawn && !i.passes; });
  const bool all_drawn = none_of([](const auto& i) { return !i.is_drawn; });
  if (!poses.has_golden && no_image) {
    work.result.verdict = Verdict::created;
  } else if (!poses.has_golden || !every_image || (!all_drawn && !poses_fail)) {
    work.result.verdict = Verdict::missing;
  } else if (poses_fail) {
    const bool renderer_differs = images_fail && work.made_with.is_pinned;
    work.result.verdict = renderer_differs ? Verdict::both_changed : Verdict::simulation_changed;
  } else if (images_fail) {
    work.result.verdict = work.made_with.is_pinned ? Verdict::renderer_changed : Verdict::environment;
  }
  if (work.result.verdict == Verdict::pass) return;
  const std::string other = provenance_differences(work.sidecar, work.made_with);
  if (!other.empty()) work.note(other);
}

}  // namespace

CheckedRun check_case(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry,
                      const Scene& scene) {
  CaseWork work(options, made_with, entry, scene);
  work.folder.clear();
  work.result.poses.has_golden = fs::exists(entry.pose_file);
  if (work.result.poses.has_golden) work.golden = read_pose_log(entry.pose_file);
  if (fs::exists(entry.track_file)) work.golden_track = read_track(entry.track_file);
  work.result.poses.has_track = work.golden_track.has_value();
  if (options.poses) check_poses(work);
  if (options.images) check_images(work);
  decide(work);
  CheckedCase checked{work.result, {}, {}, {}};
  const bool is_complete = work.result.verdict == Verdict::pass && has_own_track(work);
  if (!is_complete) prepare_approval(work, checked);
  return {std::move(checked), std::move(work.golden), std::move(work.live)};
}

}  // namespace substep
