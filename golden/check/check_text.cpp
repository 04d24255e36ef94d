#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "golden/check/check.h"

namespace substep::golden {
namespace {

constexpr const char* indent = "           ";

std::string explain_first(const PoseResult& poses, double step) {
  const FirstChange& first = poses.motion.first;
  std::string text =
      fmt::format("  poses    first difference     frame {} ({:.3f} s)", first.frame, first.frame * step);
  if (poses.frames != poses.golden_frames) {
    text += fmt::format("; golden has {} frames, the run {} (it ended \"{}\")", poses.golden_frames,
                        poses.frames, poses.end);
  }
  const bool is_beyond_end = first.frame >= std::min(poses.frames, poses.golden_frames);
  if (is_beyond_end) return text + "\n";
  const std::string who = first.body.empty() ? std::string() : fmt::format("   body {}  ", first.body);
  text += (who.empty() ? "; " : who) + change_text(first) + "\n";
  if (first.bodies.size() > 1) {
    text += fmt::format("{}in this frame {} bodies change", indent, first.bodies.size());
    constexpr std::size_t most = 6;
    for (std::size_t i = 0; i < std::min(first.bodies.size(), most); ++i) {
      text += (i == 0 ? ": " : ", ") + first.bodies[i];
    }
    text += first.bodies.size() > most ? ", …\n" : "\n";
  }
  return text + fmt::format("{}largest over all stored poses {:.2g} m, {:.2g} rad\n", indent,
                            poses.difference.largest_position, poses.difference.largest_orientation);
}

std::string explain_visibility(const CaseResult& result) {
  const PoseResult& poses = result.poses;
  const MotionComparison& motion = poses.motion;
  std::string text;
  if (motion.limit_frame >= 0) {
    text += fmt::format("{}beyond tolerance     frame {}  {}\n", indent, motion.limit_frame, motion.limit);
  }
  if (motion.contacts_frame >= 0) {
    text += fmt::format("{}touching bodies differ from frame {} on\n", indent, motion.contacts_frame);
  }
  if (result.images.empty()) return text;
  if (poses.visible_frame >= 0) {
    const int after = poses.visible_frame - motion.first.frame;
    text += fmt::format("  images   first other picture  frame {} (+{} frames, +{:.2f} s){}\n",
                        poses.visible_frame, after, after * result.step,
                        poses.visible_is_fact ? "" : ", or in one without stored poses before it");
  } else if (motion.first.frame >= 0) {
    text += fmt::format("  images   first other picture  never{}\n",
                        poses.visible_is_fact ? "" : " in the frames whose poses are stored");
  }
  return text;
}

std::string explain_poses(const CaseResult& result) {
  const PoseResult& poses = result.poses;
  if (!poses.has_golden)
    return fmt::format("  poses    no golden; the run has {} frames and ended \"{}\"\n", poses.frames,
                       poses.end);
  if (poses.motion.judgement == PoseJudgement::exact) {
    return fmt::format("  poses    exact, {} frames\n", poses.frames);
  }
  std::string text;
  if (poses.motion.first.frame >= 0) text = explain_first(poses, result.step) + explain_visibility(result);
  if (text.empty()) text = "  poses    stored ones differ from those of their hashes\n";
  std::string line;
  for (const char c : poses.difference.headers + "\n") {
    if (c != '\n') {
      line += c;
    } else if (!line.empty()) {
      text += fmt::format("{}header: {}\n", indent, line);
      line.clear();
    }
  }
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
  for (const BodyBlame& body : blame.bodies) {
    if (body.is_gone) text += fmt::format("{} is gone; ", body.name);
  }
  text += "by body, weighed by levels:";
  std::int64_t levels = 0;
  for (const BodyBlame& body : blame.bodies) levels += body.levels;
  for (std::size_t i = 0; i < std::min<std::size_t>(blame.bodies.size(), 3); ++i) {
    const BodyBlame& body = blame.bodies[i];
    text += fmt::format("{} {} {}", i == 0 ? "" : ",", percent(body.levels, levels), body.name);
  }
  return text + "\n";
}

std::string explain_pictures(const PictureComparison& comparison, const ImageTolerance& tolerance) {
  const ImageComparison& c = comparison.image;
  if (c.judgement == Judgement::exact) return "exact\n";
  if (c.judgement == Judgement::size) return "another size\n";
  std::string text =
      fmt::format("{} px differ ({:.3g} %), {} px > {} levels (limit {}), max {} at ({},{})\n", c.differing,
                  100.0 * static_cast<double>(c.differing) / static_cast<double>(c.pixels), c.above_level,
                  tolerance.level, tolerance.count, c.max, c.max_x, c.max_y);
  text += fmt::format("{}box {},{} to {},{}; {}", indent, c.left, c.top, c.right, c.bottom,
                      passes(c.judgement) ? "within tolerance, but exact is the rule on this renderer"
                                          : fmt::format("fails by {}", name(c.judgement)));
  if (comparison.flip) {
    text += fmt::format("\n{}FLIP mean {:.4f}  max {:.2f} -> {}", indent, comparison.flip->mean,
                        comparison.flip->max, comparison.flip->visibility);
    if (tolerance.flip) text += fmt::format(" (on another renderer the limit is {:g})", *tolerance.flip);
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
    text += "golden poses, this renderer: " + explain_pictures(*image.against_golden, entry.tolerance);
  }
  if (image.is_blank) text += "           the picture is blank: it shows one colour all over\n";
  if (image.new_poses) {
    text += "           new poses against golden ones, both drawn here: " +
            explain_pictures(*image.new_poses, entry.tolerance);
  }
  return text;
}

}  // namespace

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
  switch (result.verdict) {
    case Verdict::simulation_changed:
      return fmt::format("simulation changed (renderer {})",
                         result.images.empty() ? "not checked" : "unchanged");
    case Verdict::renderer_changed:
      return "renderer changed (simulation unchanged)";
    case Verdict::both_changed:
      return "both changed, simulation and renderer";
    case Verdict::error:
      return "error: it could not be checked";
    case Verdict::golden_edited:
      return "golden edited: it is not the one that was approved";
    case Verdict::scene_changed:
      return "scene changed: the file holds another scene than the goldens were made of";
    case Verdict::loading_changed:
      return "loading changed: another scene is loaded of the same file";
    case Verdict::environment:
      return "environment: this is not the pinned renderer, and the pictures are beyond the tolerance";
    case Verdict::missing:
      return "missing: goldens of this case are not there";
    case Verdict::created:
      return "new: this case has no goldens yet";
    case Verdict::pass:
      break;
  }
  return "pass";
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
