#include "golden/check/case_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "sim/error.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

bool is_same_pose(const Coordinates& a, const Coordinates& b) {
  return a.linear == b.linear && a.angular.coeffs() == b.angular.coeffs();
}

class ImageCheck {
 public:
  explicit ImageCheck(CaseContext& work) : work_(work) {}

  void check() {
    work_.result.images_checked = true;
    const SuiteCase& entry = work_.result.entry;
    std::optional<CasePainter> golden_painter;
    // Without golden poses there is nothing to tell the renderer's part by.
    work_.drawn.resize(entry.images.size());
    if (work_.golden) {
      golden_painter.emplace(work_.scene, entry, *work_.golden);
      work_.drawn = draw_frames(*golden_painter, *work_.golden);
    }
    const bool lacks_poses =
        std::any_of(work_.drawn.begin(), work_.drawn.end(), [](const Drawing& d) { return !d.is_there(); });
    if (work_.live && (!work_.result.poses.passes || lacks_poses)) {
      CasePainter painter(work_.scene, entry, *work_.live);
      work_.new_images = draw_frames(painter, *work_.live);
    }
    for (std::size_t i = 0; i < entry.images.size(); ++i) check_image(i);
    if (golden_painter && work_.live && work_.result.poses.motion.first.frame >= 0)
      find_visible(*golden_painter);
  }

 private:
  void check_image(std::size_t i) {
    const SuiteCase& entry = work_.result.entry;
    ImageResult image;
    image.frame = entry.images[i];
    image.has_golden = fs::exists(entry.image_file(image.frame));
    image.is_drawn = work_.drawn[i].is_there();
    if (work_.golden && !image.is_drawn) {
      work_.note(work_.golden->bodies.size() == work_.scene.bodies.size()
                     ? fmt::format("the golden log has no poses at frame {}", image.frame)
                     : fmt::format("the golden log has {} bodies and the scene {}: frame {} cannot be drawn",
                                   work_.golden->bodies.size() - 1, work_.scene.bodies.size() - 1,
                                   image.frame));
    }
    const std::string prefix = fmt::format("f{:04}", image.frame);
    const bool is_new = i < work_.new_images.size() && work_.new_images[i].is_there();
    if (image.is_drawn) {
      image.is_blank = is_blank(work_.drawn[i].picture);
      if (image.has_golden) judge(image, work_.drawn[i], prefix);
      if (!image.passes || is_new)
        work_.folder.write(prefix + ".actual.png", render::to_png(work_.drawn[i].picture));
      if (!image.has_golden && !is_new) add_only(image.frame, prefix + ".actual.png");
    }
    if (is_new) {
      const Drawing& fresh = work_.new_images[i];
      image.is_blank = image.is_blank || is_blank(fresh.picture);
      work_.folder.write(prefix + ".new.png", render::to_png(fresh.picture));
      if (image.is_drawn) {
        image.new_poses = compared_motion(work_.drawn[i], fresh, image.frame);
        add_pair(PicturePair::About::simulation, image.frame, *image.new_poses, prefix + ".new",
                 work_.drawn[i], fresh, prefix + ".actual.png", prefix + ".new.png");
      } else {
        add_only(image.frame, prefix + ".new.png");
      }
    }
    work_.result.images.push_back(std::move(image));
  }

  std::vector<Drawing> draw_frames(CasePainter& painter, const PoseLog& log) {
    std::vector<Drawing> drawings;
    for (const int frame : work_.result.entry.images) {
      const bool has_poses =
          frame < static_cast<int>(log.frames.size()) &&
          log.frames[static_cast<std::size_t>(frame)].poses.size() == work_.scene.bodies.size();
      drawings.push_back(has_poses ? painter.draw(log.frames[static_cast<std::size_t>(frame)].poses)
                                   : Drawing());
    }
    return drawings;
  }

  /// Old and new poses: that all bodies differ is their motion then, not the light.
  PictureComparison compared_motion(const Drawing& expected, const Drawing& actual, int frame) const {
    PictureComparison result = compared(expected, actual, frame);
    if (result.blame) result.blame->is_everywhere = false;
    return result;
  }

  PictureComparison compared(const Drawing& expected, const Drawing& actual, int frame) const {
    const Sidecar::Picture* approved = work_.sidecar.picture(frame);
    return compare_pictures(expected, actual, work_.result.entry.tolerance,
                            approved == nullptr ? std::vector<BodyExtent>() : approved->bodies,
                            body_names(work_.scene));
  }

  void add_only(int frame, const std::string& file) {
    PicturePair pair;
    pair.about = PicturePair::About::only;
    pair.frame = frame;
    pair.actual = file;
    work_.result.pairs.push_back(std::move(pair));
  }

  void add_pair(PicturePair::About about, int frame, const PictureComparison& comparison,
                const std::string& prefix, const Drawing& expected, const Drawing& actual,
                const std::string& expected_file, const std::string& actual_file) {
    if (comparison.image.judgement == Judgement::exact) return;
    PicturePair pair;
    pair.about = about;
    pair.frame = frame;
    pair.expected = expected_file;
    pair.actual = actual_file;
    pair.comparison = comparison;
    if (comparison.image.judgement != Judgement::size) {
      write_difference(work_.folder, prefix, expected, actual, pair);
    }
    work_.result.pairs.push_back(std::move(pair));
  }

  void judge(ImageResult& image, const Drawing& drawn, const std::string& prefix) {
    const SuiteCase& entry = work_.result.entry;
    const Drawing golden{render::read_png(entry.image_file(image.frame)), drawn.bodies};
    image.against_golden = compared(golden, drawn, image.frame);
    const Judgement judgement = image.against_golden->image.judgement;
    const bool is_near_enough =
        judgement == Judgement::exact || (!work_.is_exact_here() && is_within(*image.against_golden));
    image.passes = is_near_enough && !image.is_blank;
    if (is_near_enough && judgement != Judgement::exact) {
      work_.note(fmt::format(
          "frame {} within tolerance{}: this is not {}", image.frame, entry.tolerance.flip ? " by FLIP" : "",
          entry.any_renderer ? "the renderer that it was approved on" : "the pinned renderer"));
    }
    if (image.passes) return;
    work_.folder.write(prefix + ".expected.png", render::to_png(golden.picture));
    add_pair(PicturePair::About::renderer, image.frame, *image.against_golden, prefix, golden, drawn,
             prefix + ".expected.png", prefix + ".actual.png");
    const Sidecar::Picture* approved = work_.sidecar.picture(image.frame);
    const std::string found = pixel_hash(golden.picture);
    if (approved != nullptr && approved->pixels != found) {
      work_.edited.push_back(entry.image_file(image.frame).filename().string());
      work_.note(fmt::format(
          "the golden picture of frame {} is not the one that was approved (pixels {}, approved {})",
          image.frame, found, approved->pixels));
    }
  }

  /// By FLIP where the case says so, else by levels and counts.
  bool is_within(const PictureComparison& comparison) const {
    const std::optional<double>& limit = work_.result.entry.tolerance.flip;
    if (!limit || comparison.image.judgement == Judgement::size) return passes(comparison.image.judgement);
    return comparison.flip && comparison.flip->max <= *limit;
  }

  /// Draws old and new poses frame by frame, through one camera, until a pixel differs.
  void find_visible(CasePainter& painter) {
    PoseResult& poses = work_.result.poses;
    poses.visible_is_fact = true;
    for (int k = poses.motion.first.frame; k < std::min(poses.frames, poses.golden_frames); ++k) {
      const PosePair pair = poses_at(work_.golden_motion(), work_.live_motion(), k);
      const bool can_draw =
          pair.golden.size() == work_.scene.bodies.size() && pair.actual.size() == work_.scene.bodies.size();
      if (!can_draw) poses.visible_is_fact = false;
      if (!can_draw ||
          std::equal(pair.golden.begin(), pair.golden.end(), pair.actual.begin(), is_same_pose)) {
        continue;
      }
      const Drawing before = painter.draw(pair.golden);
      const Drawing after = painter.draw(pair.actual);
      if (before.picture.rgb == after.picture.rgb) continue;
      poses.visible_frame = k;
      const std::string prefix = fmt::format("f{:04}.first", k);
      work_.folder.write(prefix + ".expected.png", render::to_png(before.picture));
      work_.folder.write(prefix + ".actual.png", render::to_png(after.picture));
      add_pair(PicturePair::About::first_visible, k, compared_motion(before, after, k), prefix, before, after,
               prefix + ".expected.png", prefix + ".actual.png");
      return;
    }
  }

  CaseContext& work_;
};

}  // namespace

void check_images(CaseContext& work) {
  ImageCheck(work).check();
}

}  // namespace substep::golden
