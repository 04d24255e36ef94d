#include "golden/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "golden/check_results.h"
#include "golden/flip.h"
#include "render/renderer.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// Cases of one scene follow each other: it is loaded once.
class Stage {
 public:
  const Scene& scene(const fs::path& file) {
    if (!scene_ || scene_file_ != file) {
      scene_ = std::make_unique<Scene>(load_scene(file));
      scene_file_ = file;
    }
    return *scene_;
  }

 private:
  fs::path scene_file_;
  std::unique_ptr<Scene> scene_;
};

PictureComparison compare_pictures(const Image& expected, const Image& actual,
                                   const ImageTolerance& tolerance) {
  PictureComparison result{compare(expected, actual, tolerance), {}};
  const Judgement judgement = result.image.judgement;
  if (judgement != Judgement::exact && judgement != Judgement::size) {
    const Flip visible = flip(expected, actual);
    result.flip = {visible.mean, visible.percentile_99, visible.max, std::string(visibility(visible))};
  }
  return result;
}

bool has_poses(const PoseLog& log, const Scene& scene, int frame) {
  return frame < static_cast<int>(log.frames.size()) &&
         log.frames[static_cast<std::size_t>(frame)].poses.size() == scene.bodies.size();
}

/// The case's frames as the log has them. A frame without poses gives an empty picture.
///
/// By a renderer of its own: what it is told of the run's poses sets the ground and, where the scene has
/// none, the camera, so that one that drew another run before would give other pictures.
std::vector<Image> draw(const Scene& scene, const SuiteCase& entry, const PoseLog& log) {
  std::vector<std::vector<Coordinates>> reference;
  for (const PoseLog::Frame& frame : log.frames) {
    if (frame.poses.size() == scene.bodies.size()) reference.push_back(frame.poses);
  }
  RenderSettings settings;
  settings.width = entry.width;
  settings.height = entry.height;
  Renderer renderer(scene, settings, reference);
  std::vector<Image> images;
  for (const int frame : entry.images) {
    images.push_back(has_poses(log, scene, frame)
                         ? renderer.draw(log.frames[static_cast<std::size_t>(frame)].poses)
                         : Image());
  }
  return images;
}

class CaseCheck {
 public:
  CaseCheck(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry, Stage& stage)
      : options_(options), made_with_(made_with), stage_(stage) {
    result_.entry = entry;
    result_.files = options.output / entry.name;
  }

  CheckedCase run() {
    clear_files();
    const SuiteCase& entry = result_.entry;
    const Scene& scene = stage_.scene(entry.scene);
    if (!entry.own_step) result_.entry.settings.step = scene.step;
    result_.step = entry.settings.step;
    result_.poses.has_golden = fs::exists(entry.pose_file);
    if (result_.poses.has_golden) golden_ = read_pose_log(entry.pose_file);
    if (options_.poses) check_poses(scene);
    if (options_.images) check_images(scene);
    decide();
    CheckedCase checked{result_, {}, {}};
    if (result_.verdict != Verdict::pass) prepare_approval(scene, checked);
    return checked;
  }

 private:
  /// What a run before left here would be taken for this one's.
  void clear_files() const {
    std::error_code none;
    for (const auto& file : fs::directory_iterator(result_.files, none)) {
      const fs::path extension = file.path().extension();
      if (extension == ".png" || extension == ".poses") fs::remove(file.path());
    }
  }

  fs::path write(const std::string& file_name, std::string_view bytes) const {
    fs::create_directories(result_.files);
    write_file(result_.files / file_name, bytes);
    return result_.files / file_name;
  }

  void check_poses(const Scene& scene) {
    PoseResult& poses = result_.poses;
    poses.is_checked = true;
    Simulation simulation(scene, result_.entry.settings);
    live_ = record(simulation, result_.entry.frames, result_.entry.full_every);
    poses.frames = static_cast<int>(live_->frames.size());
    poses.end = live_->end;
    if (!golden_) return;
    poses.golden_frames = static_cast<int>(golden_->frames.size());
    poses.difference = compare(*golden_, *live_);
    const PoseDifference& difference = poses.difference;
    if (static_cast<std::size_t>(difference.body) < golden_->bodies.size()) {
      poses.body = golden_->bodies[static_cast<std::size_t>(difference.body)];
    }
    const bool same_poses = difference.largest_position == 0 && difference.largest_orientation == 0;
    poses.passes = difference.first_frame < 0 && same_poses;
    if (difference.first_frame < 0 && !same_poses) {
      result_.notes.push_back("the golden log's poses are not those that its hashes are of: it was edited");
    }
    if (poses.passes && !difference.headers.empty()) {
      result_.notes.push_back("same states, but other headers: " + one_line(difference.headers));
    }
  }

  void check_images(const Scene& scene) {
    result_.images_checked = true;
    const SuiteCase& entry = result_.entry;
    // Without golden poses there is nothing to tell the renderer's part by.
    const std::vector<Image> drawn =
        golden_ ? draw(scene, entry, *golden_) : std::vector<Image>(entry.images.size());
    const bool lacks_poses =
        std::any_of(drawn.begin(), drawn.end(), [](const Image& i) { return i.rgb.empty(); });
    const bool draws_new = live_ && (!result_.poses.passes || lacks_poses);
    new_images_ = draws_new ? draw(scene, entry, *live_) : std::vector<Image>();
    for (std::size_t i = 0; i < entry.images.size(); ++i) {
      ImageResult image;
      image.frame = entry.images[i];
      image.has_golden = fs::exists(entry.image_file(image.frame));
      image.is_drawn = !drawn[i].rgb.empty();
      if (golden_ && !image.is_drawn) {
        result_.notes.push_back(
            golden_->bodies.size() == scene.bodies.size()
                ? fmt::format("the golden log has no poses at frame {}", image.frame)
                : fmt::format("the golden log has {} bodies and the scene {}: frame {} cannot be drawn",
                              golden_->bodies.size() - 1, scene.bodies.size() - 1, image.frame));
      }
      const std::string prefix = fmt::format("f{:04}", image.frame);
      if (image.is_drawn) {
        image.is_blank = is_blank(drawn[i]);
        if (image.has_golden) judge(image, drawn[i], prefix);
        if (!image.passes) write(prefix + ".actual.png", to_png(drawn[i]));
      }
      if (draws_new && !new_images_[i].rgb.empty()) {
        image.is_blank = image.is_blank || is_blank(new_images_[i]);
        if (image.is_drawn) image.new_poses = compare_pictures(drawn[i], new_images_[i], entry.tolerance);
        write(prefix + ".new.png", to_png(new_images_[i]));
      }
      result_.images.push_back(std::move(image));
    }
    drawn_ = drawn;
  }

  void judge(ImageResult& image, const Image& drawn, const std::string& prefix) {
    const SuiteCase& entry = result_.entry;
    const Image golden = read_png(entry.image_file(image.frame));
    image.against_golden = compare_pictures(golden, drawn, entry.tolerance);
    const Judgement judgement = image.against_golden->image.judgement;
    const bool is_near_enough = judgement == Judgement::exact || (!made_with_.is_pinned && passes(judgement));
    image.passes = is_near_enough && !image.is_blank;
    if (is_near_enough && judgement != Judgement::exact) {
      result_.notes.push_back(
          fmt::format("frame {} within tolerance: this is not the pinned renderer", image.frame));
    }
    if (image.passes) return;
    write(prefix + ".expected.png", to_png(golden));
    if (judgement != Judgement::size)
      write(prefix + ".difference.png", to_png(difference_image(golden, drawn)));
    const std::string approved = approved_pixels(entry.sidecar, image.frame);
    const std::string found = pixel_hash(golden);
    if (!approved.empty() && approved != found) {
      result_.notes.push_back(fmt::format(
          "the golden picture of frame {} is not the one that was approved (pixels {}, approved {})",
          image.frame, found, approved));
    }
  }

  void decide() {
    const PoseResult& poses = result_.poses;
    const auto& images = result_.images;
    const bool no_image =
        std::none_of(images.begin(), images.end(), [](const auto& i) { return i.has_golden; });
    const bool every_image =
        std::all_of(images.begin(), images.end(), [](const auto& i) { return i.has_golden; });
    const bool poses_fail = poses.is_checked && !poses.passes;
    const bool images_fail =
        std::any_of(images.begin(), images.end(), [](const auto& i) { return i.is_drawn && !i.passes; });
    const bool all_drawn =
        std::all_of(images.begin(), images.end(), [](const auto& i) { return i.is_drawn; });
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
    const std::string other = provenance_differences(result_.entry.sidecar, made_with_);
    if (!other.empty()) result_.notes.push_back(other);
  }

  /// Writes what approving would copy, and finds what forbids it.
  void prepare_approval(const Scene& scene, CheckedCase& checked) {
    const SuiteCase& entry = result_.entry;
    std::string& refusal = checked.result.refusal;
    if (!result_.poses.is_checked || !result_.images_checked) {
      refusal = fmt::format(
          "only half of it was checked, and poses and pictures are approved together: 'substep check --case "
          "{}'",
          entry.name);
    }
    if (live_) {
      const std::string text = to_text(*live_);
      if (!result_.poses.passes || text != read_bytes(entry.pose_file)) {
        offer(checked, write("actual.poses", text), entry.pose_file);
      }
    }
    if (!refusal.empty()) return;
    if (!made_with_.is_pinned) {
      refusal = "it was drawn by " + made_with_.renderer + ", which is not the pinned renderer";
      return;
    }
    const bool from_live = !new_images_.empty();
    std::vector<const Image*> pictures;
    for (std::size_t i = 0; i < entry.images.size(); ++i) {
      const ImageResult& image = result_.images[i];
      const Image& picture = from_live ? new_images_[i] : drawn_[i];
      if (picture.rgb.empty()) {
        refusal = fmt::format("the run has no frame {}: it ended \"{}\"", image.frame, live_->end);
        return;
      }
      if (is_blank(picture)) {
        refusal = fmt::format("frame {} is blank", image.frame);
        return;
      }
      pictures.push_back(&picture);
      const bool is_unchanged =
          image.has_golden && read_png(entry.image_file(image.frame)).rgb == picture.rgb;
      if (is_unchanged) continue;
      const std::string file_name = fmt::format("f{:04}.{}.png", image.frame, from_live ? "new" : "actual");
      offer(checked, result_.files / file_name, entry.image_file(image.frame));
    }
    checked.sidecar = make_sidecar(result_, *live_, scene, pictures, made_with_);
  }

  static void offer(CheckedCase& checked, const fs::path& from, const fs::path& to) {
    checked.offers.push_back({from, content_hash(read_bytes(from)), to,
                              fs::exists(to) ? content_hash(read_bytes(to)) : std::string()});
  }

  static std::string one_line(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    std::string line;
    for (const char c : text) line += c == '\n' ? std::string("; ") : std::string(1, c);
    return line;
  }

  const CheckOptions& options_;
  const MadeWith& made_with_;
  Stage& stage_;
  CaseResult result_;
  std::optional<PoseLog> golden_;
  std::optional<PoseLog> live_;
  std::vector<Image> drawn_;
  std::vector<Image> new_images_;
};

}  // namespace

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::simulation_changed:
      return "simulation changed";
    case Verdict::renderer_changed:
      return "renderer changed";
    case Verdict::both_changed:
      return "both changed";
    case Verdict::environment:
      return "environment";
    case Verdict::missing:
      return "missing";
    case Verdict::created:
      return "new";
  }
  return "?";
}

int CheckResult::exit_code() const {
  const auto has = [&](auto&& predicate) { return std::any_of(cases.begin(), cases.end(), predicate); };
  const bool differs = has([](const CaseResult& result) {
    return result.verdict != Verdict::pass && result.verdict != Verdict::environment;
  });
  if (differs || !orphans.empty()) return 1;
  return has([](const CaseResult& result) { return result.verdict == Verdict::environment; }) ? 3 : 0;
}

CheckResult check(const CheckOptions& options,
                  const std::function<void(const CaseResult&, int number, int of)>& after_case) {
  const Suite suite = read_suite(options.suite);
  const std::vector<SuiteCase> chosen = select(suite, options.cases);
  CheckResult result;
  result.options = options;
  result.made_with = made_with(suite.folder(), options.images);
  std::error_code none;
  fs::create_directories(options.output, none);
  // An interrupted check must not leave the results of the one before as its own.
  fs::remove(results_file(options.output), none);
  Stage stage;
  std::vector<CheckedCase> checked;
  for (const SuiteCase& entry : chosen) {
    checked.push_back(CaseCheck(options, result.made_with, entry, stage).run());
    result.cases.push_back(checked.back().result);
    if (after_case)
      after_case(result.cases.back(), static_cast<int>(checked.size()), static_cast<int>(chosen.size()));
  }
  if (options.cases.empty()) result.orphans = orphans(suite);
  write_results(result, checked);
  return result;
}

}  // namespace substep
