#include "golden/check/case_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "golden/check/approval_candidates.h"
#include "golden/check/case_context.h"
#include "golden/check/case_images.h"
#include "golden/check/case_verdict.h"
#include "golden/check/motion_page.h"
#include "golden/suite/scene_parts.h"
#include "sim/error.h"
#include "sim/simulation.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::string line;
  for (const char c : text) line += c == '\n' ? std::string("; ") : std::string(1, c);
  return line;
}

/// Whether the golden pictures are what is drawn here, and not only near it or good beside it: else nothing
/// can be noted of them.
bool draws_its_goldens(const CaseContext& work) {
  const auto& images = work.result.images;
  const bool is_theirs =
      !work.result.entry.any_renderer || images.empty() || work.sidecar.platform == work.made_with.platform;
  return is_theirs && std::all_of(images.begin(), images.end(), [](const ImageResult& image) {
           return image.against_golden && image.against_golden->image.judgement == Judgement::exact;
         });
}

/// Whether the sidecar and the track of a case that passes say what is true of its run.
bool is_up_to_date(const CaseContext& work) {
  const Sidecar& sidecar = work.sidecar;
  if (!work.live) return true;
  // Nothing passes by its poses being near enough and is noted anew for it.
  if (work.result.poses.motion.judgement != PoseJudgement::exact) return true;
  return sidecar.scene_hash == fmt::format("{:016x}", work.scene.hash) &&
         sidecar.parts == scene_parts(work.scene) &&
         sidecar.pose_log_hash == content_hash(to_text(*work.live)) &&
         sidecar.track_hash == approved_track_hash(work);
}

void check_poses(CaseContext& work) {
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
  poses.bodies = static_cast<int>(work.live->bodies.size()) - 1;
  poses.modelled = work.live->modelled;
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
    work.edited.push_back(work.result.entry.pose_file.filename().string());
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

/// Where the motion is another than the golden one's, a page that plays both: for who has the check's folder
/// and not the program.
void write_motion_page(CaseContext& work) {
  CaseResult& result = work.result;
  const bool differs = work.golden && work.golden_track && work.live_track && !result.poses.passes;
  // Without pictures there may be no renderer, which says where the page looks from.
  if (result.verdict == Verdict::pass || !differs || !work.options.images) return;
  std::vector<std::vector<Coordinates>> live;
  for (const Track::Frame& frame : work.live_track->frames) live.push_back(frame.poses);
  try {
    work.folder.write("player.html", motion_page(work.scene, result.entry.settings, live, *work.golden_track,
                                                 result.entry.frames));
    result.player = "player.html";
  } catch (const Error& error) {
    work.note(fmt::format("no page plays it: {}", error.what()));
  }
}

}  // namespace

CheckedCase check_case(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry,
                       const Scene& scene) {
  const auto start = std::chrono::steady_clock::now();
  CaseContext work(options, made_with, entry, scene);
  work.folder.clear();
  work.result.poses.has_golden = fs::exists(entry.pose_file);
  if (work.result.poses.has_golden) work.golden = read_pose_log(entry.pose_file);
  if (fs::exists(entry.track_file)) work.golden_track = read_track(entry.track_file);
  work.result.poses.has_track = work.golden_track.has_value();
  find_edited_logs(work);
  if (options.poses) check_poses(work);
  if (options.images && !entry.images.empty()) check_images(work);
  decide(work);
  write_motion_page(work);
  const bool is_complete =
      work.result.verdict == Verdict::pass && (is_up_to_date(work) || !draws_its_goldens(work));
  // After all that is noted.
  CheckedCase checked{work.result, {}, {}, work.sidecar.made_with};
  if (!is_complete) prepare_approval(work, checked);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  checked.result.seconds = spent.count();
  return checked;
}

CheckedCase failed_case(const CheckOptions& options, const SuiteCase& entry, const std::string& why) {
  CheckedCase checked;
  CaseResult& result = checked.result;
  result.entry = entry;
  result.files = options.output / entry.name;
  CaseFolder(result.files).clear();
  result.verdict = Verdict::error;
  result.cause = one_line(why);
  result.refusal = "it could not be checked";
  return checked;
}

}  // namespace substep::golden
