#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <span>
#include <sstream>

#include "golden/check/case_context.h"

namespace substep::golden {
namespace {

/// The halves of a case, poses and pictures, whose failures are not explained yet.
struct Failing {
  bool poses = false;
  bool images = false;

  bool any() const { return poses || images; }
  /// Removes the explained halves; returns whether there were any.
  bool explain(bool poses_too, bool images_too) {
    const bool explains = (poses && poses_too) || (images && images_too);
    poses = poses && !poses_too;
    images = images && !images_too;
    return explains;
  }
};

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// Explains failures by goldens that were edited: edited poses fail both halves, a picture its own frame.
void explain_edits(CaseContext& context, Failing& failing) {
  const SuiteCase& entry = context.result.entry;
  if (context.edited.empty()) return;
  const bool poses = contains(context.edited, entry.pose_file.filename().string());
  const auto& images = context.result.images;
  const bool all_images = std::ranges::all_of(images, [&](const ImageResult& image) {
    return image.passes || contains(context.edited, entry.image_file(image.frame).filename().string());
  });
  if (failing.any() && !failing.explain(poses, poses || all_images)) return;
  context.result.cause = fmt::format("{} differs from what was approved", fmt::join(context.edited, ", "));
  if (!failing.any()) context.result.verdict = Verdict::golden_edited;
}

/// Explains failures by a scene file that changed, or by other bodies that are loaded from the same file.
void explain_inputs(CaseContext& context, Failing& failing) {
  const bool is_other_file = context.sidecar.scene_hash != hash_text(context.scene.hash);
  const std::vector<std::string> names = context.golden ? context.golden->bodies : std::vector<std::string>();
  SceneDifference difference = scene_difference(context.sidecar.parts, context.scene, names);
  // The digests lack the scene's sub-steps; a suite may set its own.
  const SuiteCase& entry = context.result.entry;
  const int substeps = context.sidecar.run.value("substeps", entry.settings.substeps);
  const bool sets_own = std::ranges::find(entry.own_settings, "substeps") != entry.own_settings.end();
  if (is_other_file && !sets_own && substeps != entry.settings.substeps) {
    difference.moves = true;
    difference.text += difference.text.empty() ? "sub-steps" : "; sub-steps";
  }
  // Other simulators place their bodies themselves.
  const bool is_loaded_otherwise = !is_other_file && context.result.poses.motion.first.frame == 0 &&
                                   difference.text.empty() && entry.author.empty();
  if (is_loaded_otherwise) difference = {true, true, "the bodies stand elsewhere at frame 0"};
  if (!failing.explain(difference.moves, difference.is_drawn)) return;
  context.result.verdict = is_other_file ? Verdict::scene_changed : Verdict::loading_changed;
  context.result.cause = difference.text;
  // A file beside the scene may be missing.
  for (const std::string& warning : context.scene.warnings) context.note(warning);
  // Pictures may differ without a fault on a renderer other than the goldens'.
  if (failing.poses || (failing.images && context.is_exact_here())) {
    context.result.cause += failing.poses ? "; that does not explain its poses: the simulation changed, too"
                                          : "; that does not explain its pictures: the renderer changed, too";
  }
}

/// Returns the bodies that are gone, else light, camera or sky, else the body that differs most; or nothing.
std::string cause_of_picture(const Blame& blame) {
  std::string gone;
  for (const BodyBlame& body : blame.bodies)
    if (body.is_gone) gone += (gone.empty() ? "" : ", ") + body.name;
  if (!gone.empty()) return "gone: " + gone;
  if (blame.is_everywhere) return "light, camera or sky";
  return blame.bodies.empty() ? std::string() : blame.bodies.front().name;
}

/// Returns true where the sidecar or the track is missing, and notes which.
bool lacks_sidecar_or_track(CaseContext& context) {
  const SuiteCase& entry = context.result.entry;
  if (!context.sidecar.is_there)
    context.note(fmt::format("there is no {}", entry.sidecar.filename().string()));
  if (!context.golden_track)
    context.note(fmt::format("there is no {}", entry.track_file.filename().string()));
  return !context.sidecar.is_there || !context.golden_track;
}

/// Returns the first frame and body that move differently, or what differs in the first picture.
std::string first_difference(const CaseResult& result) {
  const FirstChange& first = result.poses.motion.first;
  if (result.verdict == Verdict::simulation_changed || result.verdict == Verdict::both_changed)
    return fmt::format("from frame {} on{}{}", first.frame, first.body.empty() ? "" : ", ", first.body);
  for (const ImageResult& image : result.images) {
    if (image.passes || !image.against_golden || !image.against_golden->blame) continue;
    return cause_of_picture(*image.against_golden->blame);
  }
  return {};
}

constexpr const char* indent = "           ";

std::string explain_first(const PoseResult& poses, double step) {
  const FirstChange& first = poses.motion.first;
  std::string text =
      fmt::format("  poses    first difference     frame {} ({:.3f} s)", first.frame, first.frame * step);
  if (poses.frames != poses.golden_frames)
    text += fmt::format("; golden has {} frames, the run {} (it ended \"{}\")", poses.golden_frames,
                        poses.frames, poses.end);
  const bool is_beyond_end = first.frame >= std::min(poses.frames, poses.golden_frames);
  if (is_beyond_end) return text + "\n";
  text += first.body.empty() ? "; " : fmt::format("   body {}  ", first.body);
  text += change_text(first) + "\n";
  if (const std::size_t count = first.bodies.size(); count > 1) {
    constexpr std::size_t most = 6;
    const std::span shown(first.bodies.data(), std::min(count, most));
    text += fmt::format("{}in this frame {} bodies change: {}{}\n", indent, count, fmt::join(shown, ", "),
                        count > most ? ", …" : "");
  }
  return text + fmt::format("{}largest over all stored poses {:.2g} m, {:.2g} rad\n", indent,
                            poses.difference.largest_position, poses.difference.largest_orientation);
}

std::string explain_visibility(const CaseResult& result) {
  const PoseResult& poses = result.poses;
  const MotionComparison& motion = poses.motion;
  std::string text;
  if (motion.limit_frame >= 0)
    text += fmt::format("{}beyond tolerance     frame {}  {}\n", indent, motion.limit_frame, motion.limit);
  if (motion.contacts_frame >= 0)
    text += fmt::format("{}touching bodies differ from frame {} on\n", indent, motion.contacts_frame);
  if (result.images.empty()) return text;
  if (poses.visible_frame >= 0) {
    const int after = poses.visible_frame - motion.first.frame;
    text += fmt::format("  images   first difference     frame {} (+{} frames, +{:.2f} s){}\n",
                        poses.visible_frame, after, after * result.entry.settings.step,
                        poses.visible_frame_is_certain ? "" : ", or an earlier one without stored poses");
  } else if (motion.first.frame >= 0) {
    text += fmt::format("  images   first difference     never{}\n",
                        poses.visible_frame_is_certain ? "" : " in the frames whose poses are stored");
  }
  return text;
}

std::string explain_poses(const CaseResult& result) {
  const PoseResult& poses = result.poses;
  if (!poses.has_golden)
    return fmt::format("  poses    no golden; the run has {} frames and ended \"{}\"\n", poses.frames,
                       poses.end);
  if (poses.motion.judgement == PoseJudgement::exact)
    return fmt::format("  poses    exact, {} frames\n", poses.frames);
  std::string text = "  poses    those stored in the golden log do not match its hashes\n";
  if (poses.motion.first.frame >= 0)
    text = explain_first(poses, result.entry.settings.step) + explain_visibility(result);
  std::istringstream headers(poses.difference.headers);
  for (std::string line; std::getline(headers, line);) text += fmt::format("{}header: {}\n", indent, line);
  return text;
}

std::string percent(std::int64_t part, std::int64_t whole) {
  return fmt::format("{:.3g} %",
                     whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

std::string explain_blame(const Blame& blame) {
  std::string text = fmt::format("{}{} of the foreground differs; ", indent,
                                 percent(blame.differing_foreground, blame.foreground));
  if (blame.is_everywhere) return text + "all over the picture: light, camera or sky, not one body\n";
  for (const BodyBlame& body : blame.bodies)
    if (body.is_gone) text += fmt::format("{} is gone; ", body.name);
  text += "by body, as fractions of the summed levels:";
  std::int64_t levels = 0;
  for (const BodyBlame& body : blame.bodies) levels += body.levels;
  for (std::size_t i = 0; i < std::min<std::size_t>(blame.bodies.size(), 3); ++i) {
    const BodyBlame& body = blame.bodies[i];
    text += fmt::format("{} {} {}", i == 0 ? "" : ",", percent(body.levels, levels), body.name);
  }
  return text + "\n";
}

std::string explain_pictures(const PictureComparison& comparison, const ImageTolerance& tolerance,
                             bool must_be_exact) {
  const ImageComparison& c = comparison.image;
  if (c.judgement == Judgement::exact) return "exact\n";
  if (c.judgement == Judgement::size) return "another size\n";
  std::string text = fmt::format("{} px differ ({}), {} px > {} levels (limit {}), max {} at ({},{})\n",
                                 c.differing, percent(c.differing, c.pixels), c.above_level, tolerance.level,
                                 tolerance.count, c.max, c.max_x, c.max_y);
  text += fmt::format("{}box {},{} to {},{}; {}", indent, c.left, c.top, c.right, c.bottom,
                      !is_within(comparison, tolerance)
                          ? fmt::format("fails by {}", tolerance.flip ? "FLIP" : name(c.judgement))
                      : must_be_exact ? "within tolerance, but this renderer must be exact"
                                      : "within tolerance");
  if (comparison.flip) {
    text += fmt::format("\n{}FLIP mean {:.4f}  max {:.2f} -> {}", indent, comparison.flip->mean,
                        comparison.flip->max, visibility(*comparison.flip));
    if (tolerance.flip)
      text += fmt::format(" ({}limit {:g})", must_be_exact ? "on another renderer " : "", *tolerance.flip);
  }
  text += "\n";
  if (comparison.blame) text += explain_blame(*comparison.blame);
  return text;
}

std::string explain_image(const ImageResult& image, const SuiteCase& entry) {
  std::string text = fmt::format("  f{:04}    ", image.frame);
  if (!image.is_drawn) {
    text += image.has_golden ? "cannot be drawn from the golden poses\n" : "no golden\n";
  } else if (!image.against_golden) {
    text += "no golden picture\n";
  } else {
    text += "golden poses, this renderer: " +
            explain_pictures(*image.against_golden, entry.tolerance, image.must_be_exact);
  }
  if (image.is_blank) text += fmt::format("{}the picture is blank: it shows one colour all over\n", indent);
  if (image.new_poses)
    text += fmt::format("{}new poses against golden ones, both drawn here: {}", indent,
                        explain_pictures(*image.new_poses, entry.tolerance, false));
  return text;
}

}  // namespace

void decide(CaseContext& context) {
  const PoseResult& poses = context.result.poses;
  const auto& images = context.result.images;
  const bool none_has_golden = std::ranges::none_of(images, &ImageResult::has_golden);
  const bool all_have_goldens = std::ranges::all_of(images, &ImageResult::has_golden);
  const bool all_drawn = std::ranges::all_of(images, &ImageResult::is_drawn);
  const auto fails = [](const ImageResult& image) { return image.is_drawn && !image.passes; };
  Failing failing{!poses.passes, std::ranges::any_of(images, fails)};
  Verdict& verdict = context.result.verdict;
  bool is_explained = true;
  if (!poses.has_golden && none_has_golden) {
    verdict = Verdict::created;  // rule 1 of case_context.h
  } else if (!poses.has_golden || !all_have_goldens || (!all_drawn && !failing.poses) ||
             lacks_sidecar_or_track(context)) {
    verdict = Verdict::missing;  // rule 1, too
  } else if (failing.any() || !context.edited.empty()) {
    explain_edits(context, failing);                                                  // rule 2
    if (verdict == Verdict::pass && failing.any()) explain_inputs(context, failing);  // rules 3 and 4
    is_explained = verdict != Verdict::pass;
    if (!is_explained) {  // rule 5
      const bool is_exact = context.is_exact_here();
      verdict = failing.poses && failing.images && is_exact ? Verdict::both_changed
                : failing.poses                             ? Verdict::simulation_changed
                : is_exact                                  ? Verdict::renderer_changed
                                                            : Verdict::environment;
      context.result.cause = first_difference(context.result);
    }
  }
  if (verdict == Verdict::pass) return;
  std::string& cause = context.result.cause;
  const std::string settings = settings_differences(context.sidecar, context.result.entry);
  if (!settings.empty() && is_explained) {
    context.note("golden made with " + settings);
  } else if (!settings.empty()) {
    cause = fmt::format("settings changed: {}{}{}", settings, cause.empty() ? "" : "; ", cause);
  }
  const std::string other = provenance_differences(context.sidecar, context.made_with);
  if (!other.empty()) context.note("golden made with " + other);
}

std::string change_text(const FirstChange& first) {
  if (first.axis == ' ') {
    return first.size_frame < 0 ? "no poses are stored from there on" : "only velocities differ";
  }
  const bool turned = first.axis == 'r';
  std::string text = fmt::format("{} {:.2g} {}",
                                 turned ? std::string("orientation") : fmt::format("position {}", first.axis),
                                 first.size, turned ? "rad" : "m");
  if (first.size_frame != first.frame) text += fmt::format(" (at frame {})", first.size_frame);
  return text;
}

std::string meaning(const CaseResult& result) {
  constexpr std::array<const char*, verdict_names.size()> meanings{
      "error: the case could not be checked",
      "golden edited: a golden differs from the approved one",
      "both changed, simulation and renderer",
      "simulation changed (renderer unchanged)",
      "loading changed: the same file loads as another scene",
      "scene changed: the file differs from the one that the goldens were made of",
      "renderer changed (simulation unchanged)",
      "missing: some goldens of this case are missing",
      "new: this case has no goldens yet",
      "environment: this is not the renderer of the goldens, and the pictures are beyond the tolerance",
      "pass"};
  if (result.verdict == Verdict::simulation_changed && result.images.empty())
    return "simulation changed (renderer not checked)";
  return meanings[static_cast<std::size_t>(result.verdict)];
}

std::string explain(const CaseResult& result) {
  std::string text = fmt::format("FAILED {}   VERDICT: {}\n", result.entry.name, meaning(result));
  if (!result.cause.empty()) text += fmt::format("  cause    {}\n", result.cause);
  if (result.verdict != Verdict::error) {
    text += explain_poses(result);
    for (const ImageResult& image : result.images) text += explain_image(image, result.entry);
  }
  for (const std::string& note : result.notes) text += fmt::format("  note     {}\n", note);
  return text;
}

}  // namespace substep::golden
