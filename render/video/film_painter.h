#pragma once
/// Paints a film's frames.

#include <functional>
#include <optional>
#include <vector>

#include "render/video/comparison.h"
#include "render/video/composition.h"
#include "render/video/frame_queue.h"
#include "render/video/overlay.h"
#include "render/video/video.h"

namespace substep::render {

/// The parts of a film that all its frames share.
struct Film {
  const Scene& scene;
  const VideoSettings& settings;
  const Comparison& comparison;
  OverlayScales scales = scales_of(scene, comparison, settings.overlays);
  std::vector<std::optional<Departure>> departures{};  ///< of the runs, where the film freezes

  std::size_t second() const;  ///< in frames
  /// Returns the first frame at which a run has left the reference.
  std::optional<std::size_t> freeze() const;
};

Film film_of(const Scene& scene, const VideoSettings& settings, const Comparison& comparison);

Composition composition_of(const Film& film, int width, int height);

/// Paints film frames of this size; `every` of the comparison's frames is painted, the others are left out.
std::function<Painter()> painters(const Film& film, const Composition& composition, int every);

}  // namespace substep::render
