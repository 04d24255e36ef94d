#pragma once
/// Overlays on a panel's picture that explain it.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "render/camera.h"
#include "render/image.h"
#include "render/video/comparison.h"
#include "render/video/composition.h"

namespace substep::render {

/// Colours of tints: viridis, at five positions. Its lightness rises evenly, also for the colour-blind.
inline constexpr std::array<Color, 5> tint_ramp{
    {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};

namespace overlay_colors {
inline constexpr Color gap_color{255, 60, 80};
inline constexpr Color white{255, 255, 255};
inline constexpr Color arrow_color{255, 214, 64};
inline constexpr Color idle_color{190, 200, 212};  ///< of contacts without an impulse
}  // namespace overlay_colors

/// Returns the tint at a fraction of its scale, clamped to 0 to 1.
Color ramp_at(double fraction);

struct Overlays {
  bool trails = false;    ///< the path of each body's centre in the scene's last second
  bool joints = false;    ///< the anchors that each joint holds together, and their gap
  bool ghost = false;     ///< the outline of the bodies in the reference
  bool contacts = false;  ///< contact points, and the impulses there as arrows
  /// The quantity that colours the bodies: distance from the reference, penetration or speed.
  enum class Tint { none, error, penetration, speed };
  Tint tint = Tint::none;

  bool any() const { return trails || joints || ghost || contacts || tint != Tint::none; }
};

/// Returns the overlays of these names. Throws Error for an unknown name or a second tint.
Overlays overlays_named(const std::vector<std::string>& names);

/// The scales of overlays, the same in all panels and frames.
struct OverlayScales {
  bool is_logarithmic = true;     ///< of the tint
  double low = 1e-3, high = 1;    ///< of the tint, m or m/s
  double metres_per_impulse = 1;  ///< length of an arrow of 1 N·s, m
};
OverlayScales scales_of(const Scene& scene, const Comparison& comparison, const Overlays& overlays);

/// Returns the key of the overlays, and of the rings where a film freezes.
std::vector<KeyEntry> key_of(const Overlays& overlays, const OverlayScales& scales, bool has_rings);

/// The input of one panel's overlays at film frame k.
struct OverlayFrame {
  const Scene& scene;
  const View& view;
  const Run& run;
  OverlayScales scales = {};
  const ReferenceRun* reference = nullptr;  ///< where it is known at k
  std::size_t k = 0;
  std::size_t trail = 30;                   ///< length of a trail, frames
  const Image* bodies = nullptr;            ///< of Renderer::draw_bodies at the run's poses
  const Image* reference_bodies = nullptr;  ///< the same at the reference's poses
};

void draw_overlays(Image& picture, const Overlays& overlays, const OverlayFrame& frame);

/// Draws a ring round a body that has diverged from the frame's reference, and its distance.
void draw_divergence(Image& picture, int diverged, const OverlayFrame& frame);

/// Returns a point's position in a picture of this size, pixels from the top left corner; nothing where the
/// point is behind the eye or far outside of the picture.
std::optional<std::array<double, 2>> project(const View& view, const Vector3& point, int width, int height);

}  // namespace substep::render
