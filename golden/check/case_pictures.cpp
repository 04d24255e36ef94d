#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "golden/check/case_context.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

bool is_same_pose(const Coordinates& a, const Coordinates& b) {
  return a.linear == b.linear && a.angular.coeffs() == b.angular.coeffs();
}

/// Returns the drawings of the case's frames, empty ones for those without poses of all bodies.
std::vector<Drawing> draw_frames(CasePainter& painter, const PoseLog& log, const CaseContext& context) {
  std::vector<Drawing> drawings;
  for (const int frame : context.result.entry.images) {
    const auto k = static_cast<std::size_t>(frame);
    const bool has_poses = k < log.frames.size() && log.frames[k].poses.size() == context.scene.bodies.size();
    drawings.push_back(has_poses ? painter.draw(log.frames[k].poses) : Drawing());
  }
  return drawings;
}

/// Compares two pictures, and finds the bodies that differ.
PictureComparison compare_pictures(const Drawing& expected, const Drawing& actual, int frame,
                                   const CaseContext& context) {
  PictureComparison result{compare(expected.picture, actual.picture, context.result.entry.tolerance), {}, {}};
  if (result.image.judgement == Judgement::exact || result.image.judgement == Judgement::size) return result;
  result.flip = flip(expected.picture, actual.picture);
  std::vector<std::string> names;
  for (const Body& body : context.scene.bodies) names.push_back(body.name);
  const Sidecar::Picture* approved = context.sidecar.picture(frame);
  result.blame = blame(expected.picture, actual.picture, expected.bodies, actual.bodies,
                       approved == nullptr ? std::vector<BodyExtent>() : approved->bodies, names);
  return result;
}

/// Compares pictures of old and new poses, in which motion, not light, can make all bodies differ.
PictureComparison compare_poses(const Drawing& expected, const Drawing& actual, int frame,
                                const CaseContext& context) {
  PictureComparison result = compare_pictures(expected, actual, frame, context);
  if (result.blame) result.blame->is_everywhere = false;
  return result;
}

/// Adds two pictures to the result where they differ, and writes a heat map of the difference.
void add_pair(PicturePair::About about, int frame, const std::string& expected, const std::string& actual,
              const PictureComparison& comparison, CaseContext& context) {
  if (comparison.image.judgement == Judgement::exact) return;
  PicturePair pair{about, frame, expected, actual, {}, comparison};
  if (comparison.flip) {
    constexpr std::array<const char*, 3> kinds{"", ".new", ".first"};
    pair.flip = fmt::format("f{:04}{}.flip.png", frame, kinds[static_cast<std::size_t>(about)]);
    context.write(pair.flip, heat_map(*comparison.flip));
  }
  context.result.pairs.push_back(std::move(pair));
}

/// Returns whether the golden picture is the approved one; notes where it differs, as after an interrupted
/// approval.
bool is_approved_picture(const render::Image& golden, int frame, CaseContext& context) {
  if (!context.sidecar.is_there) return true;
  const Sidecar::Picture* approved = context.sidecar.picture(frame);
  const std::string found = hash_text(hash(golden));
  if (approved != nullptr && approved->pixels == found) return true;
  context.edited.push_back(context.result.entry.image_file(frame).filename().string());
  context.note(
      fmt::format("the golden picture of frame {} differs from the approved one (pixels {}, approved {})",
                  frame, found, approved == nullptr ? "none" : approved->pixels));
  return false;
}

/// Judges a drawing of the golden poses by the golden picture.
void judge(ImageResult& image, const Drawing& drawn, const std::string& prefix, CaseContext& context) {
  const SuiteCase& entry = context.result.entry;
  const fs::path file = entry.image_file(image.frame);
  const Drawing golden{read_goldens([&] { return render::read_png(file); }), drawn.bodies};
  image.against_golden = compare_pictures(golden, drawn, image.frame, context);
  const bool is_exact = image.against_golden->image.judgement == Judgement::exact;
  image.must_be_exact = context.is_exact_here();
  const bool is_tolerated =
      !is_exact && !image.must_be_exact && is_within(*image.against_golden, entry.tolerance);
  const bool is_approved = is_approved_picture(golden.picture, image.frame, context);
  image.passes = (is_exact || is_tolerated) && !image.is_blank && is_approved;
  if (is_tolerated)
    context.note(fmt::format(
        "frame {} within tolerance{}: this is not {}", image.frame, entry.tolerance.flip ? " by FLIP" : "",
        entry.any_renderer ? "the renderer that it was approved on" : "the pinned renderer"));
  if (image.passes || (is_exact && !image.is_blank)) return;
  context.write(prefix + ".expected.png", golden.picture);
  add_pair(PicturePair::About::renderer, image.frame, prefix + ".expected.png", prefix + ".actual.png",
           *image.against_golden, context);
}

/// Checks a picture of the case: `drawn` of the golden poses, `fresh` of the live ones; either may be empty.
void check_image(int frame, const Drawing& drawn, const Drawing& fresh, CaseContext& context) {
  ImageResult image;
  image.frame = frame;
  image.has_golden = fs::exists(context.result.entry.image_file(frame));
  image.is_drawn = drawn.is_there();
  if (context.golden && !image.is_drawn) {
    const std::size_t golden = context.golden->bodies.size() - 1;
    const std::size_t here = context.scene.bodies.size() - 1;
    context.note(golden == here
                     ? fmt::format("the golden log has no poses at frame {}", frame)
                     : fmt::format("the golden log has {} bodies and the scene {}: frame {} cannot be drawn",
                                   golden, here, frame));
  }
  const std::string prefix = fmt::format("f{:04}", frame);
  image.is_blank = image.is_drawn && is_blank(drawn.picture);
  if (image.is_drawn && image.has_golden) judge(image, drawn, prefix, context);
  if (image.is_drawn && (!image.passes || fresh.is_there()))
    context.write(prefix + ".actual.png", drawn.picture);
  if (fresh.is_there()) {
    image.is_blank = image.is_blank || is_blank(fresh.picture);
    context.write(prefix + ".new.png", fresh.picture);
  }
  if (image.is_drawn && fresh.is_there()) {
    image.new_poses = compare_poses(drawn, fresh, frame, context);
    add_pair(PicturePair::About::simulation, frame, prefix + ".actual.png", prefix + ".new.png",
             *image.new_poses, context);
  } else if (fresh.is_there() || (image.is_drawn && !image.has_golden)) {
    const std::string file = prefix + (fresh.is_there() ? ".new.png" : ".actual.png");
    context.result.pairs.push_back({PicturePair::About::only, frame, {}, file, {}, {}});
  }
  context.result.images.push_back(std::move(image));
}

/// Draws old and new poses frame by frame, through one camera, until a pixel differs.
void find_visible(CasePainter& painter, CaseContext& context) {
  PoseResult& poses = context.result.poses;
  poses.visible_frame_is_certain = true;
  for (int k = poses.motion.first.frame; k < std::min(poses.frames, poses.golden_frames); ++k) {
    const PosePair pair = poses_at(context.golden_motion(), context.live_motion(), k);
    const bool can_draw = pair.golden.size() == context.scene.bodies.size() &&
                          pair.actual.size() == context.scene.bodies.size();
    if (!can_draw) poses.visible_frame_is_certain = false;
    if (!can_draw || std::equal(pair.golden.begin(), pair.golden.end(), pair.actual.begin(), is_same_pose))
      continue;
    const Drawing before = painter.draw(pair.golden);
    const Drawing after = painter.draw(pair.actual);
    if (before.picture.rgb == after.picture.rgb) continue;
    poses.visible_frame = k;
    const std::string prefix = fmt::format("f{:04}.first", k);
    context.write(prefix + ".expected.png", before.picture);
    context.write(prefix + ".actual.png", after.picture);
    return add_pair(PicturePair::About::first_visible, k, prefix + ".expected.png", prefix + ".actual.png",
                    compare_poses(before, after, k, context), context);
  }
}

}  // namespace

bool is_within(const PictureComparison& comparison, const ImageTolerance& tolerance) {
  const bool is_by_flip = tolerance.flip && comparison.flip;
  return is_by_flip ? comparison.flip->max <= *tolerance.flip : passes(comparison.image.judgement);
}

CasePainter::CasePainter(const Scene& scene, const SuiteCase& entry, const PoseLog& log)
    : renderer_(scene, {.width = entry.width, .height = entry.height}, full_frames(log, scene)) {}

std::vector<std::vector<Coordinates>> full_frames(const PoseLog& log, const Scene& scene) {
  std::vector<std::vector<Coordinates>> result;
  for (const PoseLog::Frame& frame : log.frames)
    if (frame.poses.size() == scene.bodies.size()) result.push_back(frame.poses);
  return result;
}

void check_images(CaseContext& context) {
  const SuiteCase& entry = context.result.entry;
  std::optional<CasePainter> painter;
  context.drawn.resize(entry.images.size());
  if (context.golden) {
    painter.emplace(context.scene, entry, *context.golden);
    context.drawn = draw_frames(*painter, *context.golden, context);
  }
  const bool lacks_poses = !std::ranges::all_of(context.drawn, &Drawing::is_there);
  if (context.live && (!context.result.poses.passes || lacks_poses)) {
    CasePainter live_painter(context.scene, entry, *context.live);
    context.new_images = draw_frames(live_painter, *context.live, context);
  }
  for (std::size_t i = 0; i < entry.images.size(); ++i) {
    check_image(entry.images[i], context.drawn[i],
                context.new_images.empty() ? Drawing() : context.new_images[i], context);
  }
  if (painter && context.live && context.result.poses.motion.first.frame >= 0)
    find_visible(*painter, context);
}

}  // namespace substep::golden
