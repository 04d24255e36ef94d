#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "golden/check/case_context.h"
#include "golden/suite/scene_parts.h"

namespace substep::golden {
namespace {

/// The halves of a case that fail for no reason found so far.
struct Failing {
  bool poses = false;
  bool images = false;

  bool any() const { return poses || images; }
  /// Takes what is explained away; returns whether that was anything.
  bool explain(bool poses_too, bool images_too) {
    const bool explains = (poses && poses_too) || (images && images_too);
    poses = poses && !poses_too;
    images = images && !images_too;
    return explains;
  }
};

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Edited poses fail both halves, an edited picture its own frame only.
void explain_edits(CaseContext& work, Failing& failing) {
  const SuiteCase& entry = work.result.entry;
  if (work.edited.empty()) return;
  const bool poses = contains(work.edited, entry.pose_file.filename().string());
  const auto& images = work.result.images;
  const bool all_images = std::all_of(images.begin(), images.end(), [&](const ImageResult& image) {
    return image.passes || contains(work.edited, entry.image_file(image.frame).filename().string());
  });
  if (failing.any() && !failing.explain(poses, poses || all_images)) return;
  work.result.cause = fmt::format("{} is not what was approved", fmt::join(work.edited, ", "));
  if (!failing.any()) work.result.verdict = Verdict::golden_edited;
}

/// Another file, or other bodies of the same.
void explain_inputs(CaseContext& work, Failing& failing) {
  const bool is_other_file = work.sidecar.scene_hash != fmt::format("{:016x}", work.scene.hash);
  const std::vector<std::string> names = work.golden ? work.golden->bodies : std::vector<std::string>();
  const SceneDifference difference = scene_difference(work.sidecar.parts, work.scene, names);
  const bool starts_otherwise = work.result.poses.motion.first.frame == 0;
  Verdict verdict = Verdict::scene_changed;
  std::string cause = difference.text;
  bool moves = difference.moves;
  bool is_drawn = difference.is_drawn;
  if (!is_other_file) {
    verdict = Verdict::loading_changed;
    // Other simulators place their bodies themselves.
    if (starts_otherwise && cause.empty() && work.result.entry.author.empty()) {
      moves = is_drawn = true;
      cause = "the bodies stand elsewhere at frame 0";
    }
  }
  if (!failing.explain(moves, is_drawn)) return;
  work.result.verdict = verdict;
  work.result.cause = cause;
  // On another renderer than theirs pictures may differ for no reason here.
  if (failing.poses || (failing.images && work.is_exact_here())) {
    work.result.cause += failing.poses ? "; that does not explain its poses: the simulation changed, too"
                                       : "; that does not explain its pictures: the renderer changed, too";
  }
}

/// The one body or the light that a picture's difference is put down to.
std::string cause_of_picture(const Blame& blame) {
  std::string gone;
  for (const BodyBlame& body : blame.bodies) {
    if (body.is_gone) gone += (gone.empty() ? "" : ", ") + body.name;
  }
  if (!gone.empty()) return "gone: " + gone;
  if (blame.is_everywhere) return "light, camera or sky";
  return blame.bodies.empty() ? std::string() : blame.bodies.front().name;
}

/// Returns true where the sidecar or the track is missing, and notes which.
bool lacks_explanation(CaseContext& work) {
  const SuiteCase& entry = work.result.entry;
  if (!work.sidecar.is_there) work.note(fmt::format("there is no {}", entry.sidecar.filename().string()));
  if (!work.golden_track) work.note(fmt::format("there is no {}", entry.track_file.filename().string()));
  return !work.sidecar.is_there || !work.golden_track;
}

void find_cause(CaseContext& work) {
  CaseResult& result = work.result;
  const FirstChange& first = result.poses.motion.first;
  if (result.verdict == Verdict::simulation_changed || result.verdict == Verdict::both_changed) {
    result.cause =
        fmt::format("from frame {} on{}{}", first.frame, first.body.empty() ? "" : ", ", first.body);
    return;
  }
  for (const ImageResult& image : result.images) {
    if (image.passes || !image.against_golden || !image.against_golden->blame) continue;
    result.cause = cause_of_picture(*image.against_golden->blame);
    return;
  }
}

}  // namespace

void decide(CaseContext& work) {
  const PoseResult& poses = work.result.poses;
  const auto& images = work.result.images;
  const auto none_of = [&](auto&& is) { return std::none_of(images.begin(), images.end(), is); };
  const bool no_image = none_of([](const auto& i) { return i.has_golden; });
  const bool every_image = none_of([](const auto& i) { return !i.has_golden; });
  const bool all_drawn = none_of([](const auto& i) { return !i.is_drawn; });
  Failing failing{!poses.passes, !none_of([](const auto& i) { return i.is_drawn && !i.passes; })};
  Verdict& verdict = work.result.verdict;
  if (!poses.has_golden && no_image) {
    verdict = Verdict::created;
  } else if (!poses.has_golden || !every_image || (!all_drawn && !failing.poses) || lacks_explanation(work)) {
    verdict = Verdict::missing;
  } else if (failing.any() || !work.edited.empty()) {
    explain_edits(work, failing);
    if (verdict == Verdict::pass && failing.any()) explain_inputs(work, failing);
    if (verdict == Verdict::pass) {
      const bool is_exact = work.is_exact_here();
      verdict = failing.poses && failing.images && is_exact ? Verdict::both_changed
                : failing.poses                             ? Verdict::simulation_changed
                : is_exact                                  ? Verdict::renderer_changed
                                                            : Verdict::environment;
      find_cause(work);
    }
  }
  if (verdict == Verdict::pass) return;
  const std::string other = provenance_differences(work.sidecar, work.made_with);
  if (!other.empty()) work.note(other);
}

}  // namespace substep::golden
