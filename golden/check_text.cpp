#include <fmt/format.h>

#include <array>
#include <cmath>

#include "golden/check.h"

namespace substep {
namespace {

std::string explain_difference(const PoseDifference& d, const PoseResult& poses, double step) {
  std::string text =
      fmt::format("  poses    first difference   frame {} ({:.3f} s)", d.first_frame, d.first_frame * step);
  if (poses.frames != poses.golden_frames) {
    text += fmt::format("; golden has {} frames, the run {} (it ended \"{}\")", poses.golden_frames,
                        poses.frames, poses.end);
  }
  if (d.first_full_frame < 0) return text + "; no poses are stored from there on\n";
  if (d.axis == ' ') {
    return text +
           fmt::format("; poses of frame {} are equal: only velocities differ so far\n", d.first_full_frame);
  }
  const bool turned = d.axis == 'r';
  text +=
      fmt::format("   body {}  {}  {:.2g} {}{}\n", poses.body,
                  turned ? "orientation" : fmt::format("position {}", d.axis), d.size, turned ? "rad" : "m",
                  d.first_full_frame == d.first_frame
                      ? std::string()
                      : fmt::format("  (at frame {}, the next one stored)", d.first_full_frame));
  text += fmt::format("           largest so far      {:.2g} m, {:.2g} rad\n", d.largest_position,
                      d.largest_orientation);
  return text;
}

std::string explain_poses(const PoseResult& poses, double step) {
  if (!poses.is_checked) return "  poses    not checked\n";
  if (!poses.has_golden)
    return fmt::format("  poses    no golden; the run has {} frames and ended \"{}\"\n", poses.frames,
                       poses.end);
  if (poses.passes) return fmt::format("  poses    exact, {} frames\n", poses.frames);
  std::string text = explain_difference(poses.difference, poses, step);
  std::string line;
  for (const char c : poses.difference.headers + "\n") {
    if (c != '\n') {
      line += c;
    } else if (!line.empty()) {
      text += fmt::format("           header: {}\n", line);
      line.clear();
    }
  }
  return text;
}

std::string explain_pictures(const PictureComparison& comparison, const ImageTolerance& tolerance) {
  const ImageComparison& c = comparison.image;
  if (c.judgement == Judgement::exact) return "exact\n";
  if (c.judgement == Judgement::size) return "another size\n";
  constexpr const char* indent = "           ";
  std::string text =
      fmt::format("{} px differ ({:.3g} %), {} px > {} levels (limit {}), max {} at ({},{})\n", c.above[0],
                  100.0 * static_cast<double>(c.above[0]) / static_cast<double>(c.pixels), c.above_level,
                  tolerance.level, tolerance.count, c.max, c.max_x, c.max_y);
  text += fmt::format(
      "{}mean {:.3g} levels (limit {:g}); worst 32x32 tile ({},{}): {:.3g} (limit {:g}); box {},{} to "
      "{},{}\n",
      indent, c.mean, tolerance.mean, c.tile_x, c.tile_y, c.tile_mean, tolerance.tile_mean, c.left, c.top,
      c.right, c.bottom);
  text += fmt::format("{}px above 0/1/2/4/8/16/32 levels: {}", indent, c.above[0]);
  for (std::size_t i = 1; i < c.above.size(); ++i) text += fmt::format(" {}", c.above[i]);
  if (passes(c.judgement)) {
    text += "; within tolerance, but exact is the rule on this renderer";
  } else {
    text += fmt::format("; fails by {}", name(c.judgement));
  }
  if (comparison.flip) {
    text += fmt::format("\n{}FLIP mean {:.4f}  p99 {:.2f}  max {:.2f} -> {}", indent, comparison.flip->mean,
                        comparison.flip->percentile_99, comparison.flip->max, comparison.flip->visibility);
  }
  return text + "\n";
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
  if (image.is_blank) text += "           the picture is blank\n";
  if (image.new_poses) {
    text += "           new poses against golden ones, both drawn here: " +
            explain_pictures(*image.new_poses, entry.tolerance);
  }
  return text;
}

/// The program's options that give this case's run.
std::string run_command(const CaseResult& result) {
  const Settings& s = result.entry.settings;
  std::string command = fmt::format("substep run {} --algorithm {} --step {}", result.entry.scene.string(),
                                    name(s.algorithm), s.step);
  const Settings plain;
  if (s.substeps != plain.substeps) command += fmt::format(" --substeps {}", s.substeps);
  if (s.iterations != plain.iterations) command += fmt::format(" --iterations {}", s.iterations);
  if (s.tau != plain.tau) command += fmt::format(" --tau {}", s.tau);
  if (s.kappa != plain.kappa) command += fmt::format(" --kappa {}", s.kappa);
  if (s.joints != plain.joints) command += fmt::format(" --joints {}", name(s.joints));
  if (s.relaxation != plain.relaxation) command += fmt::format(" --relaxation {}", s.relaxation);
  if (s.tolerance != plain.tolerance) command += fmt::format(" --tolerance {}", s.tolerance);
  return command + fmt::format(" --duration {} --output {}", result.entry.frames * s.step,
                               (result.files / "replay.poses").string());
}

std::string meaning(const CaseResult& result) {
  switch (result.verdict) {
    case Verdict::simulation_changed:
      return fmt::format("simulation changed (renderer {})",
                         result.images_checked ? "unchanged" : "not checked");
    case Verdict::renderer_changed:
      return fmt::format("renderer changed (simulation {})",
                         result.poses.is_checked ? "unchanged" : "not checked");
    case Verdict::both_changed:
      return "both changed, simulation and renderer";
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

}  // namespace

std::string explain(const CaseResult& result, const CheckOptions& options) {
  const std::string& case_name = result.entry.name;
  std::string text = fmt::format("FAILED {}   VERDICT: {}\n", case_name, meaning(result));
  text += explain_poses(result.poses, result.step);
  if (!result.images_checked) text += "  images   not checked\n";
  for (const ImageResult& image : result.images) text += explain_image(image, result.entry);
  for (const std::string& note : result.notes) text += fmt::format("  note     {}\n", note);
  text += fmt::format("  files    {}\n", result.files.string());
  text += fmt::format("  replay   {}\n", run_command(result));
  const CheckOptions defaults;
  std::string where;
  if (options.suite != defaults.suite) where += fmt::format(" --suite {}", options.suite.string());
  if (options.output != defaults.output) where += fmt::format(" --output {}", options.output.string());
  if (!result.refusal.empty()) {
    text += fmt::format("  approve  not from this check: {}\n", result.refusal);
  } else {
    text += fmt::format("  approve  substep approve {}{} --reason \"...\"\n", case_name, where);
  }
  return text;
}

std::string totals(const CheckResult& result) {
  std::array<int, 7> counts{};
  for (const CaseResult& entry : result.cases) ++counts[static_cast<std::size_t>(entry.verdict)];
  std::string text;
  for (const Verdict verdict : {Verdict::simulation_changed, Verdict::renderer_changed, Verdict::both_changed,
                                Verdict::environment, Verdict::missing, Verdict::created}) {
    text += fmt::format("{} {}, ", counts[static_cast<std::size_t>(verdict)], name(verdict));
  }
  return text + fmt::format("{} orphan, {} pass", result.orphans.size(),
                            counts[static_cast<std::size_t>(Verdict::pass)]);
}

}  // namespace substep
