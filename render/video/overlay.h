#pragma once
/// What is drawn over a panel's picture, to explain it.

#include <array>
#include <string>
#include <vector>

#include "render/camera.h"
#include "render/image.h"
#include "render/video/comparison.h"
#include "render/video/composition.h"

namespace substep::render {

/// Colours of errors: viridis, at five places. Its lightness rises evenly, for all eyes.
inline constexpr std::array<Color, 5> error_ramp{
    {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};

/// Colours of marks.
inline constexpr Color gap_color{255, 60, 80};
inline constexpr Color anchor_color{255, 255, 255};
inline constexpr Color ghost_color{255, 255, 255};
inline constexpr Color arrow_color{255, 214, 64};
inline constexpr Color idle_color{190, 200, 212};

/// Returns the colour of errors at a part of their scale, 0 to 1.
Color ramp_at(double share);

struct Overlays {
  bool trails = false;    ///< the way of each body's centre in the last second of film
  bool joints = false;    ///< the anchors that a joint holds together, and the gap where it does not
  bool ghost = false;     ///< where the reference has the bodies: their outline
  bool contacts = false;  ///< contact points, and the impulses there as arrows
  /// What colours the bodies: their distance from where the reference has them, how deep they are in others,
  /// how fast they are.
  enum class Tint { none, error, penetration, velocity };
  Tint tint = Tint::none;

  bool any() const { return trails || joints || ghost || contacts || tint != Tint::none; }
};

/// From their names. Throws Error.
Overlays overlays_named(const std::vector<std::string>& names);

/// What overlays are measured by: the same in all panels and frames.
struct OverlayScales {
  bool is_logarithmic = true;     ///< the tint's
  double low = 1e-3, high = 1;    ///< of the tint: m or m/s
  double metres_per_impulse = 1;  ///< of arrows: m for 1 N·s
};
OverlayScales scales_of(const Scene& scene, const Comparison& comparison, const Overlays& overlays);

/// What the overlays, and the rings where a film freezes, mean, piece by piece.
std::vector<KeyEntry> key_of(const Overlays& overlays, const OverlayScales& scales, bool has_rings);

/// What one panel's overlays need at film frame k.
struct OverlayFrame {
  const Scene& scene;
  const View& view;
  const Run& run;
  OverlayScales scales = {};
  const ReferenceRun* reference = nullptr;  ///< where it is known at k
  std::size_t k = 0;
  std::size_t trail = 30;                   ///< frames that a trail is long
  const Image* bodies = nullptr;            ///< the run's, of Renderer::draw_bodies
  const Image* reference_bodies = nullptr;  ///< the reference's
};

void draw_overlays(Image& picture, const Overlays& overlays, const OverlayFrame& frame);

/// A ring round the body that has left the reference, and how far it is.
void draw_departure(Image& picture, const Departure& departure, const OverlayFrame& frame);

/// Where the view shows a point, in pixels from the top left corner of a picture of this size. False where it
/// is behind the eye.
bool project(const View& view, const Vector3& point, int width, int height, double& x, double& y);

}  // namespace substep::render
