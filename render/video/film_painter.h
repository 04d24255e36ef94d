#pragma once
/// Paints a film's frames.

#include <functional>
#include <optional>
#include <vector>

#include "render/image.h"
#include "render/video/comparison.h"
#include "render/video/overlay.h"
#include "render/video/video.h"

namespace substep::render {

/// The data that all frames of a film share.
struct Film {
  const Scene& scene;
  const VideoSettings& settings;
  const Comparison& comparison;
  OverlayScales scales = scales_of(scene, comparison, settings.overlays);
  std::vector<std::optional<Divergence>> divergences{};  ///< of the runs, where the film freezes

  /// Returns the first frame at which a run has diverged from the reference.
  std::optional<std::size_t> freeze() const;
};

Film film_of(const Scene& scene, const VideoSettings& settings, const Comparison& comparison);

/// Paints every `every`-th frame of the comparison in this size, on the settings' threads, and passes them to
/// `take` in order, on the calling thread. A few frames a thread are held at once. Throws the first exception
/// of a thread or of `take`.
void paint_frames(const Film& film, int width, int height, int every,
                  const std::function<void(int k, const Image& frame)>& take);

}  // namespace substep::render
