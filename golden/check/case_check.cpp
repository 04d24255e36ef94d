#include "golden/check/case_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "golden/check/case_pictures.h"
#include "golden/suite/sidecar.h"
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

class CaseCheck {
 public:
  CaseCheck(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry,
            const Scene& scene)
      : options_(options), made_with_(made_with), scene_(scene), folder_(options.output / entry.name) {
    result_.entry = entry;
    result_.files = options.output / entry.name;
    if (!entry.own_step) result_.entry.settings.step = scene.step;
    result_.step = result_.entry.settings.step;
    sidecar_ = read_sidecar(entry.sidecar);
  }

  CheckedRun run() {
    folder_.clear();
    const SuiteCase& entry = result_.entry;
    result_.poses.has_golden = fs::exists(entry.pose_file);
    if (result_.poses.has_golden) golden_ = read_pose_log(entry.pose_file);
    if (fs::exists(entry.track_file)) golden_track_ = read_track(entry.track_file);
    result_.poses.has_track = golden_track_.has_value();
    if (options_.poses) check_poses();
    if (options_.images) check_images();
    decide();
    CheckedCase checked{result_, {}, {}, {}};
    const bool is_complete = result_.verdict == Verdict::pass && has_own_track();
    if (!is_complete) prepare_approval(checked);
    return {std::move(checked), std::move(golden_), std::move(live_)};
  }

 private:
  /// A track is written with its poses; by hand or by an older program they can come apart.
  bool has_own_track() {
    if (!golden_track_) return false;
    if (!live_ || result_.poses.motion.judgement != PoseJudgement::exact) return true;
    const bool is_own = to_bytes(*golden_track_) == to_bytes(*live_track_);
    if (!is_own) note("its track is of another run than its poses: approve it by name to renew it");
    return is_own;
  }

  void check_poses() {
    PoseResult& poses = result_.poses;
    poses.is_checked = true;
    const Settings& settings = result_.entry.settings;
    Simulation simulation(scene_, settings);
    Tracker tracker(scene_, settings);
    tracker.add(simulation.state());
    live_ = record(simulation, result_.entry.frames, result_.entry.full_every,
                   [&](int, const StepReport&) { tracker.add(simulation.state()); });
    live_track_ = tracker.take();
    poses.frames = static_cast<int>(live_->frames.size());
    poses.end = live_->end;
    if (!golden_) return;
    poses.golden_frames = static_cast<int>(golden_->frames.size());
    poses.difference = compare(*golden_, *live_);
    const PoseDifference& difference = poses.difference;
    const bool same_poses = difference.largest_position == 0 && difference.largest_orientation == 0;
    if (difference.first_frame >= 0) {
      poses.motion =
          compare_motion(golden_motion(), live_motion(), viewfinder(scene_, result_.entry, *golden_),
                         result_.entry.pose_tolerance);
    } else if (!same_poses) {
      poses.motion.judgement = PoseJudgement::differs;
      note("the golden log's poses are not those that its hashes are of: it was edited");
    }
    poses.passes = passes(poses.motion.judgement);
    if (poses.motion.judgement == PoseJudgement::within) {
      note(fmt::format("poses differ from frame {} on, within the case's pose tolerance",
                       poses.motion.first.frame));
    }
    if (poses.motion.judgement == PoseJudgement::exact && !difference.headers.empty()) {
      note("same states, but other headers: " + one_line(difference.headers));
    }
  }

  LoggedMotion golden_motion() const { return {&*golden_, golden_track_ ? &*golden_track_ : nullptr}; }
  LoggedMotion live_motion() const { return {&*live_, &*live_track_}; }

  void note(std::string text) { result_.notes.push_back(std::move(text)); }

  std::vector<Drawing> draw_frames(CasePainter& painter, const PoseLog& log) {
    std::vector<Drawing> drawings;
    for (const int frame : result_.entry.images) {
      const bool has_poses = frame < static_cast<int>(log.frames.size()) &&
                             log.frames[static_cast<std::size_t>(frame)].poses.size() == scene_.bodies.size();
      drawings.push_back(has_poses ? painter.draw(log.frames[static_cast<std::size_t>(frame)].poses)
                                   : Drawing());
    }
    return drawings;
  }

  void check_images() {
    result_.images_checked = true;
    const SuiteCase& entry = result_.entry;
    std::optional<CasePainter> golden_painter;
    // Without golden poses there is nothing to tell the renderer's part by.
    drawn_.resize(entry.images.size());
    if (golden_) {
      golden_painter.emplace(scene_, entry, *golden_);
      drawn_ = draw_frames(*golden_painter, *golden_);
    }
    const bool lacks_poses =
        std::any_of(drawn_.begin(), drawn_.end(), [](const Drawing& d) { return !d.is_there(); });
    if (live_ && (!result_.poses.passes || lacks_poses)) {
      CasePainter painter(scene_, entry, *live_);
      new_images_ = draw_frames(painter, *live_);
    }
    for (std::size_t i = 0; i < entry.images.size(); ++i) check_image(i);
    if (golden_painter && live_ && result_.poses.motion.first.frame >= 0) find_visible(*golden_painter);
  }

  void check_image(std::size_t i) {
    const SuiteCase& entry = result_.entry;
    ImageResult image;
    image.frame = entry.images[i];
    image.has_golden = fs::exists(entry.image_file(image.frame));
    image.is_drawn = drawn_[i].is_there();
    if (golden_ && !image.is_drawn) {
      note(golden_->bodies.size() == scene_.bodies.size()
               ? fmt::format("the golden log has no poses at frame {}", image.frame)
               : fmt::format("the golden log has {} bodies and the scene {}: frame {} cannot be drawn",
                             golden_->bodies.size() - 1, scene_.bodies.size() - 1, image.frame));
    }
    const std::string prefix = fmt::format("f{:04}", image.frame);
    const bool is_new = i < new_images_.size() && new_images_[i].is_there();
    if (image.is_drawn) {
      image.is_blank = is_blank(drawn_[i].picture);
      if (image.has_golden) judge(image, drawn_[i], prefix);
      if (!image.passes || is_new) folder_.write(prefix + ".actual.png", to_png(drawn_[i].picture));
      if (!image.has_golden && !is_new) add_only(image.frame, prefix + ".actual.png");
    }
    if (is_new) {
      const Drawing& fresh = new_images_[i];
      image.is_blank = image.is_blank || is_blank(fresh.picture);
      folder_.write(prefix + ".new.png", to_png(fresh.picture));
      if (image.is_drawn) {
        image.new_poses = compared_motion(drawn_[i], fresh, image.frame);
        add_pair(PicturePair::About::simulation, image.frame, *image.new_poses, prefix + ".new", drawn_[i],
                 fresh, prefix + ".actual.png", prefix + ".new.png");
      } else {
        add_only(image.frame, prefix + ".new.png");
      }
    }
    result_.images.push_back(std::move(image));
  }

  /// Old and new poses: that all bodies differ is their motion then, not the light.
  PictureComparison compared_motion(const Drawing& expected, const Drawing& actual, int frame) const {
    PictureComparison result = compared(expected, actual, frame);
    if (result.blame) result.blame->is_everywhere = false;
    return result;
  }

  PictureComparison compared(const Drawing& expected, const Drawing& actual, int frame) const {
    const Sidecar::Picture* approved = sidecar_.picture(frame);
    std::vector<std::string> names;
    for (const Body& body : scene_.bodies) names.push_back(body.name);
    return compare_pictures(expected, actual, result_.entry.tolerance,
                            approved == nullptr ? std::vector<BodyExtent>() : approved->bodies, names);
  }

  void add_only(int frame, const std::string& file) {
    PicturePair pair;
    pair.about = PicturePair::About::only;
    pair.frame = frame;
    pair.actual = file;
    result_.pairs.push_back(std::move(pair));
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
      write_difference(folder_, prefix, expected, actual, pair);
    }
    result_.pairs.push_back(std::move(pair));
  }

  void judge(ImageResult& image, const Drawing& drawn, const std::string& prefix) {
    const SuiteCase& entry = result_.entry;
    const Drawing golden{read_png(entry.image_file(image.frame)), drawn.bodies};
    image.against_golden = compared(golden, drawn, image.frame);
    const Judgement judgement = image.against_golden->image.judgement;
    const bool is_near_enough = judgement == Judgement::exact || (!made_with_.is_pinned && passes(judgement));
    const bool is_alternate = !is_near_enough && equals_alternate(image.frame, drawn.picture);
    image.passes = (is_near_enough || is_alternate) && !image.is_blank;
    if (is_near_enough && judgement != Judgement::exact) {
      note(fmt::format("frame {} within tolerance: this is not the pinned renderer", image.frame));
    }
    if (image.passes) return;
    folder_.write(prefix + ".expected.png", to_png(golden.picture));
    add_pair(PicturePair::About::renderer, image.frame, *image.against_golden, prefix, golden, drawn,
             prefix + ".expected.png", prefix + ".actual.png");
    const Sidecar::Picture* approved = sidecar_.picture(image.frame);
    const std::string found = pixel_hash(golden.picture);
    if (approved != nullptr && approved->pixels != found) {
      note(fmt::format(
          "the golden picture of frame {} is not the one that was approved (pixels {}, approved {})",
          image.frame, found, approved->pixels));
    }
  }

  bool equals_alternate(int frame, const Image& drawn) {
    const std::string pixels = pixel_hash(drawn);
    for (const Alternate& alternate : sidecar_.alternates) {
      if (alternate.frame != frame || alternate.pixels != pixels) continue;
      if (read_png(alternate.file).rgb != drawn.rgb) continue;
      note(
          fmt::format("frame {} equals {}: {}", frame, alternate.file.filename().string(), alternate.reason));
      return true;
    }
    return false;
  }

  /// Draws old and new poses frame by frame, through one camera, until a pixel differs.
  void find_visible(CasePainter& painter) {
    PoseResult& poses = result_.poses;
    poses.visible_is_fact = true;
    for (int k = poses.motion.first.frame; k < std::min(poses.frames, poses.golden_frames); ++k) {
      const PosePair pair = poses_at(golden_motion(), live_motion(), k);
      const bool can_draw =
          pair.golden.size() == scene_.bodies.size() && pair.actual.size() == scene_.bodies.size();
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
      folder_.write(prefix + ".expected.png", to_png(before.picture));
      folder_.write(prefix + ".actual.png", to_png(after.picture));
      add_pair(PicturePair::About::first_visible, k, compared_motion(before, after, k), prefix, before, after,
               prefix + ".expected.png", prefix + ".actual.png");
      return;
    }
  }

  static bool is_same_pose(const Coordinates& a, const Coordinates& b) {
    return a.linear == b.linear && a.angular.coeffs() == b.angular.coeffs();
  }

  void decide() {
    const PoseResult& poses = result_.poses;
    const auto& images = result_.images;
    const auto none_of = [&](auto&& is) { return std::none_of(images.begin(), images.end(), is); };
    const bool no_image = none_of([](const auto& i) { return i.has_golden; });
    const bool every_image = none_of([](const auto& i) { return !i.has_golden; });
    const bool poses_fail = poses.is_checked && !poses.passes;
    const bool images_fail = !none_of([](const auto& i) { return i.is_drawn && !i.passes; });
    const bool all_drawn = none_of([](const auto& i) { return !i.is_drawn; });
    if (!poses.has_golden && no_image) {
      result_.verdict = Verdict::created;
    } else if (!poses.has_golden || !every_image || (!all_drawn && !poses_fail)) {
      result_.verdict = Verdict::missing;
    } else if (poses_fail) {
      const bool renderer_differs = images_fail && made_with_.is_pinned;
      result_.verdict = renderer_differs ? Verdict::both_changed : Verdict::simulation_changed;
    } else if (images_fail) {
      result_.verdict = made_with_.is_pinned ? Verdict::renderer_changed : Verdict::environment;
    }
    if (result_.verdict == Verdict::pass) return;
    const std::string other = provenance_differences(sidecar_, made_with_);
    if (!other.empty()) note(other);
  }

  void offer_logs(CheckedCase& checked) {
    if (!live_) return;
    const SuiteCase& entry = result_.entry;
    const std::string text = to_text(*live_);
    const bool is_another = !result_.poses.has_golden || text != read_bytes(entry.pose_file);
    // A run within its tolerance is no reason for another golden.
    const bool is_wanted = !result_.poses.passes || result_.poses.motion.judgement == PoseJudgement::exact;
    if (is_wanted && is_another) offer(checked, folder_.write("actual.poses", text), entry.pose_file);
    const std::string track = to_bytes(*live_track_);
    if (is_wanted && (!result_.poses.has_track || track != read_bytes(entry.track_file))) {
      offer(checked, folder_.write("actual.track", track), entry.track_file);
    }
  }

  /// Writes what approving would copy, and finds what forbids it.
  void prepare_approval(CheckedCase& checked) {
    const SuiteCase& entry = result_.entry;
    std::string& refusal = checked.result.refusal;
    offer_logs(checked);
    if (!result_.poses.is_checked || !result_.images_checked) {
      refusal = fmt::format(
          "only half of it was checked, and poses and pictures are approved together: 'substep check --case "
          "{}'",
          entry.name);
      return;
    }
    const bool from_live = !new_images_.empty();
    std::vector<ApprovablePicture> pictures;
    for (std::size_t i = 0; i < entry.images.size(); ++i) {
      const ImageResult& image = result_.images[i];
      const Drawing& drawing = from_live ? new_images_[i] : drawn_[i];
      if (!drawing.is_there()) {
        refusal = fmt::format("the run has no frame {}: it ended \"{}\"", image.frame, live_->end);
        return;
      }
      if (is_blank(drawing.picture)) {
        refusal = fmt::format("frame {} is blank", image.frame);
        return;
      }
      pictures.push_back({&drawing.picture, body_extents(drawing.bodies)});
      const std::string file_name = fmt::format("f{:04}.{}.png", image.frame, from_live ? "new" : "actual");
      const bool is_unchanged =
          image.passes && !from_live
              ? true
              : image.has_golden && read_png(entry.image_file(image.frame)).rgb == drawing.picture.rgb;
      if (is_unchanged) continue;
      offer(checked, result_.files / file_name, entry.image_file(image.frame));
      if (!from_live && image.has_golden) {
        checked.alternates.push_back({image.frame, result_.files / file_name,
                                      content_hash(read_bytes(result_.files / file_name)),
                                      pixel_hash(drawing.picture)});
      }
    }
    checked.result.has_alternates = result_.poses.passes && !checked.alternates.empty();
    checked.sidecar = make_sidecar(entry, *live_, scene_, pictures, made_with_);
    if (!made_with_.is_pinned) {
      refusal = "it was drawn by " + made_with_.renderer + ", which is not the pinned renderer";
    }
  }

  static void offer(CheckedCase& checked, const fs::path& from, const fs::path& to) {
    checked.offers.push_back({from, content_hash(read_bytes(from)), to,
                              fs::exists(to) ? content_hash(read_bytes(to)) : std::string()});
  }

  const CheckOptions& options_;
  const MadeWith& made_with_;
  const Scene& scene_;
  CaseFolder folder_;
  CaseResult result_;
  Sidecar sidecar_;
  std::optional<PoseLog> golden_;
  std::optional<Track> golden_track_;
  std::optional<PoseLog> live_;
  std::optional<Track> live_track_;
  std::vector<Drawing> drawn_;
  std::vector<Drawing> new_images_;
};

}  // namespace

CheckedRun check_case(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry,
                      const Scene& scene) {
  return CaseCheck(options, made_with, entry, scene).run();
}

}  // namespace substep
