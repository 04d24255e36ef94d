#include "render/video/film_painter.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "render/renderer.h"
#include "render/video/seen_frames.h"

namespace substep::render {
namespace {

/// The run's poses at film frame k; where it diverged before, its last.
std::vector<Coordinates> poses_at(const Scene& scene, const Run& run, std::size_t k) {
  if (run.poses.empty()) return initial_state(scene).q;
  std::vector<Coordinates> poses = run.poses[std::min(k, run.poses.size() - 1)];
  for (Coordinates& pose : poses) {
    // A body far beyond sight would overflow the renderer's single precision.
    constexpr double far = 1e5;
    pose.linear = pose.linear.cwiseMax(-far).cwiseMin(far);
  }
  return poses;
}

/// Where the camera of a run is at frame k.
View view_at(const View& view, const Scene& scene, const VideoSettings& settings,
             const Comparison& comparison, const Run& run, std::size_t k) {
  const auto body = static_cast<std::size_t>(settings.camera.follows);
  Vector3 way = Vector3::Zero();
  if (!run.poses.empty()) {
    way = run.poses[std::min(k, run.poses.size() - 1)][body].linear - run.poses.front()[body].linear;
  }
  // A second of film is as many frames as its rate says.
  const double seconds = static_cast<double>(k) / settings.frame_rate;
  return moved(view, settings.camera, way, std::min(seconds, static_cast<double>(comparison.times.size())),
               middle_of(scene));
}

/// Draws one panel's pictures, by a renderer that other panels share. A picture serves all frames in which
/// nothing moves.
class PanelPainter {
 public:
  PanelPainter(const Film& film, std::size_t index, std::shared_ptr<Renderer> renderer)
      : film_(film), index_(index), renderer_(std::move(renderer)), still_(renderer_->view()) {
    shown_frames_.push_back(0);
    std::vector<Coordinates> last = poses_at(film.scene, run(), 0);
    for (std::size_t k = 1; k < film.comparison.times.size(); ++k) {
      std::vector<Coordinates> poses = poses_at(film.scene, run(), k);
      renderer_->look(view(k));
      constexpr double unseen = 0.02;  // pixels
      const bool moves = view(k) != view(shown_frames_.back()) || renderer_->moves_by(unseen, last, poses);
      shown_frames_.push_back(moves ? k : shown_frames_.back());
      if (moves) last = std::move(poses);
    }
    renderer_->look(still_);
  }

  /// Returns the picture at film frame k, with its overlays.
  Image picture(std::size_t k) {
    const VideoSettings& settings = film_.settings;
    const Comparison& comparison = film_.comparison;
    const std::vector<Coordinates> poses = poses_at(film_.scene, run(), shown_frames_[k]);
    renderer_->look(view(k));
    if (drawn_ != shown_frames_[k]) drawn_picture_ = renderer_->draw(poses);
    drawn_ = shown_frames_[k];
    const std::optional<Departure>& departure = film_.departures[index_];
    const bool is_ringed = departure && k >= departure->frame && k < departure->frame + film_.second();
    if ((!settings.overlays.any() && !is_ringed) || run().is_reference()) return drawn_picture_;
    OverlayFrame frame{film_.scene, renderer_->view(), run(), film_.scales};
    frame.k = k;
    frame.trail = film_.second();
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
    if (is_ringed) draw_departure(picture, *departure, frame);
    return picture;
  }

 private:
  const Run& run() const { return film_.comparison.runs[index_]; }
  View view(std::size_t k) const {
    return view_at(still_, film_.scene, film_.settings, film_.comparison, run(), k);
  }

  const Film& film_;
  std::size_t index_;
  std::shared_ptr<Renderer> renderer_;
  View still_;
  std::vector<std::size_t> shown_frames_;  ///< of each frame, the one whose poses it shows
  std::optional<std::size_t> drawn_;       ///< the frame whose poses were drawn last
  Image drawn_picture_;
};

}  // namespace

std::size_t Film::second() const {
  return static_cast<std::size_t>(std::max(1L, std::lround(settings.frame_rate)));
}

std::optional<std::size_t> Film::freeze() const {
  std::optional<std::size_t> first;
  for (const std::optional<Departure>& departure : departures) {
    if (departure) first = std::min(first.value_or(departure->frame), departure->frame);
  }
  return first;
}

Film film_of(const Scene& scene, const VideoSettings& settings, const Comparison& comparison) {
  Film film{scene, settings, comparison};
  for (const Run& run : comparison.runs) {
    film.departures.push_back(settings.freezes ? departure_of(scene, comparison, run) : std::nullopt);
  }
  return film;
}

Composition composition_of(const Film& film, int width, int height) {
  return {film.comparison,
          film_title(film.scene, film.settings.title),
          width,
          height,
          key_of(film.settings.overlays, film.scales, film.freeze().has_value()),
          film.settings.strips};
}

std::function<Painter()> painters(const Film& film, const Composition& composition, int every) {
  return [&film, &composition, every]() -> Painter {
    // Panels of a row are as wide as one another; another row's may be wider.
    std::map<int, std::shared_ptr<Renderer>> renderers;
    auto panels = std::make_shared<std::vector<PanelPainter>>();
    for (std::size_t run = 0; run < film.comparison.runs.size(); ++run) {
      RenderSettings pictures;
      pictures.width = composition.picture_width(run);
      pictures.height = composition.picture_height();
      pictures.steps_back = !film.settings.camera.named;
      std::shared_ptr<Renderer>& renderer = renderers[pictures.width];
      if (!renderer) {
        renderer = std::make_shared<Renderer>(seen_by(film.settings.camera, film.scene), pictures,
                                              seen_frames(film.scene, film.comparison));
      }
      panels->emplace_back(film, run, renderer);
    }
    return [panels, &composition, every](int k) {
      const int frame = k * every;
      std::vector<Image> pictures;
      for (PanelPainter& panel : *panels) pictures.push_back(panel.picture(static_cast<std::size_t>(frame)));
      return composition.frame(frame, pictures);
    };
  };
}

}  // namespace substep::render
