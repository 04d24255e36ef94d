#include "render/video/film_painter.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "render/renderer.h"
#include "render/video/composition.h"
#include "render/video/film_camera.h"

namespace substep::render {
namespace {

/// Returns the run's poses at film frame k, or its last ones where it diverged before.
std::vector<Coordinates> poses_at(const Scene& scene, const Run& run, std::size_t k) {
  if (run.poses.empty()) return initial_state(scene).q;
  std::vector<Coordinates> poses = run.poses[std::min(k, run.poses.size() - 1)];
  for (Coordinates& pose : poses) {
    // Clamp bodies far beyond sight, which would overflow the renderer's single precision.
    constexpr double far = 1e5;
    pose.linear = pose.linear.cwiseMax(-far).cwiseMin(far);
  }
  return poses;
}

/// Draws one panel's pictures, with a renderer that panels share. Repeats a picture while nothing moves.
class PanelPainter {
 public:
  PanelPainter(const Film& film, std::size_t index, std::shared_ptr<Renderer> renderer)
      : film_(film), index_(index), renderer_(std::move(renderer)), still_(renderer_->view()) {
    shown_frames_.push_back(0);
    std::vector<Coordinates> last = poses_at(film.scene, run(), 0);
    for (std::size_t k = 1; k < film.comparison.times.size(); ++k) {
      std::vector<Coordinates> poses = poses_at(film.scene, run(), k);
      renderer_->change_view(view(k));
      constexpr double unseen = 0.02;  // pixels
      const bool moves = view(k) != view(shown_frames_.back()) || renderer_->moves_by(unseen, last, poses);
      shown_frames_.push_back(moves ? k : shown_frames_.back());
      if (moves) last = std::move(poses);
    }
    renderer_->change_view(still_);
  }

  /// Returns the picture at film frame k, with its overlays.
  Image picture(std::size_t k) {
    const VideoSettings& settings = film_.settings;
    const Comparison& comparison = film_.comparison;
    const std::vector<Coordinates> poses = poses_at(film_.scene, run(), shown_frames_[k]);
    renderer_->change_view(view(k));
    if (drawn_ != shown_frames_[k]) drawn_picture_ = renderer_->draw(poses);
    drawn_ = shown_frames_[k];
    const std::optional<Divergence>& divergence = film_.divergences[index_];
    const auto in_second_of_film = static_cast<std::size_t>(std::max(1L, std::lround(settings.frame_rate)));
    const bool is_ringed = divergence && k >= divergence->frame && k < run().errors.size() &&
                           k < divergence->frame + in_second_of_film;
    if ((!settings.overlays.any() && !is_ringed) || run().is_reference()) return drawn_picture_;
    OverlayFrame frame{film_.scene, renderer_->view(), run(), film_.scales};
    frame.k = k;
    const double in_second = 1 / film_.settings.comparison.frame_interval;
    frame.trail = static_cast<std::size_t>(std::max(1L, std::lround(in_second)));
    Image bodies;
    Image reference_bodies;
    if (settings.overlays.tint != Overlays::Tint::none) {
      bodies = renderer_->draw_bodies(poses);
      frame.bodies = &bodies;
    }
    if (comparison.reference && k < comparison.reference->known) {
      frame.reference = &*comparison.reference;
      if (settings.overlays.ghost) {
        reference_bodies = renderer_->draw_bodies(comparison.reference->poses[k]);
        frame.reference_bodies = &reference_bodies;
      }
    }
    Image picture = drawn_picture_;
    draw_overlays(picture, settings.overlays, frame);
    if (is_ringed) draw_divergence(picture, divergence->body, frame);
    return picture;
  }

 private:
  const Run& run() const { return film_.comparison.runs[index_]; }
  /// Returns the view at film frame k, moved with the body that the camera follows.
  View view(std::size_t k) const {
    const FilmCamera& camera = film_.settings.camera;
    const auto body = static_cast<std::size_t>(camera.follows);
    const std::vector<std::vector<Coordinates>>& poses = run().poses;
    Vector3 way = Vector3::Zero();
    if (!poses.empty())
      way = poses[std::min(k, poses.size() - 1)][body].linear - film_.scene.bodies[body].pose.position;
    const double seconds = static_cast<double>(k) / film_.settings.frame_rate;
    return moved(still_, camera, way, seconds, middle_of(film_.scene));
  }

  const Film& film_;
  std::size_t index_;
  std::shared_ptr<Renderer> renderer_;
  View still_;
  std::vector<std::size_t> shown_frames_;  ///< the frame whose poses each frame shows
  std::optional<std::size_t> drawn_;       ///< the frame whose poses were drawn last
  Image drawn_picture_;
};

/// Paints frame k; used on one thread only.
using Painter = std::function<Image(int k)>;

/// Returns a painter of film frames, for one thread: an OpenGL context belongs to one.
Painter make_painter(const Film& film, const Composition& composition, int every) {
  // Share a renderer among panels of one width.
  std::map<int, std::shared_ptr<Renderer>> renderers;
  auto panels = std::make_shared<std::vector<PanelPainter>>();
  for (std::size_t run = 0; run < film.comparison.runs.size(); ++run) {
    const RenderSettings pictures{.width = composition.picture_width(run),
                                  .height = composition.picture_height(),
                                  .steps_back = !film.settings.camera.named};
    std::shared_ptr<Renderer>& renderer = renderers[pictures.width];
    if (!renderer) {
      // Leave the way of a followed body to the camera's motion.
      std::vector<std::vector<Coordinates>> held{initial_state(film.scene).q};
      if (film.settings.camera.follows == world_body) held = seen_frames(film.scene, film.comparison);
      renderer = std::make_shared<Renderer>(seen_by(film.settings.camera, film.scene), pictures, held);
    }
    panels->emplace_back(film, run, renderer);
  }
  return [panels, &composition, every](int k) {
    const int frame = k * every;
    std::vector<Image> pictures;
    for (PanelPainter& panel : *panels) pictures.push_back(panel.picture(static_cast<std::size_t>(frame)));
    return composition.frame(frame, pictures);
  };
}

}  // namespace

std::optional<std::size_t> Film::freeze() const {
  std::optional<std::size_t> first;
  for (const std::optional<Divergence>& divergence : divergences)
    if (divergence) first = std::min(first.value_or(divergence->frame), divergence->frame);
  return first;
}

Film film_of(const Scene& scene, const VideoSettings& settings, const Comparison& comparison) {
  Film film{scene, settings, comparison};
  for (const Run& run : comparison.runs)
    film.divergences.push_back(settings.freezes ? divergence_of(scene, comparison, run) : std::nullopt);
  return film;
}

void paint_frames(const Film& film, int width, int height, int every,
                  const std::function<void(int k, const Image& frame)>& take) {
  const Composition composition(film.comparison, film_title(film.scene, film.settings.title), width, height,
                                key_of(film.settings.overlays, film.scales, film.freeze().has_value()),
                                film.settings.strips);
  const int count = (static_cast<int>(film.comparison.times.size()) - 1) / every + 1;
  const int threads = std::clamp(film.settings.comparison.threads, 1, count);
  std::vector<std::promise<Image>> frames(static_cast<std::size_t>(count));
  std::mutex mutex;
  std::condition_variable changed;
  int next = 0;   // the first frame that no worker has
  int taken = 0;  // number of frames that `take` has received
  // Return the next frame, once it is at most a few after the last one taken; `count` at the end.
  const auto claim = [&] {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return next >= count || next < taken + 4 * threads; });
    return std::min(next++, count);
  };
  // Set `next` or `taken`, and wake the workers that wait for it.
  const auto set = [&](int& number, int value) {
    const std::lock_guard lock(mutex);
    number = value;
    changed.notify_all();
  };
  // Paint frames until there are no more.
  const auto work = [&] {
    Painter paint;
    for (int k = claim(); k < count; k = claim()) {
      std::promise<Image>& frame = frames[static_cast<std::size_t>(k)];
      try {
        if (!paint) paint = make_painter(film, composition, every);
        frame.set_value(paint(k));
      } catch (...) {
        frame.set_exception(std::current_exception());
      }
    }
  };
  std::vector<std::jthread> workers;
  try {
    for (int i = 0; i < threads; ++i) workers.emplace_back(work);
    for (int k = 0; k < count; ++k) {
      take(k, frames[static_cast<std::size_t>(k)].get_future().get());
      set(taken, k + 1);
    }
  } catch (...) {
    set(next, count);
    throw;
  }
}

}  // namespace substep::render
