#pragma once
/// Draws a scene at given poses, headlessly, with software OpenGL: the same pixels on every machine.

#include <memory>
#include <span>
#include <string>

#include "render/camera.h"
#include "render/image.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Pins driver, vector width and CPU features, on which pictures depend. Call first thing in main(): the
/// environment is read once a process, and must be set before there are threads.
void pin_renderer();

/// Returns "llvmpipe (LLVM 15.0.6, 128 bits), 4.5 (Core Profile) Mesa 22.3.6": part of a golden's provenance.
std::string renderer_description();

/// Returns whether goldens are exact on this renderer.
bool is_pinned_renderer();

struct RenderSettings {
  int width = 1280;
  int height = 720;
  bool antialiasing = true;
  bool shadows = true;
  bool steps_back = false;  ///< moves the scene's camera back until it sees all frames: stepped_back()
  /// Side of the tiles that a picture is drawn in, pixels, even. 0: 2048 for a picture of more than 2²³
  /// pixels or 8192 a side, else one tile.
  int tile = 0;
};

/// Throws Error where pictures of this size cannot be drawn, before memory is taken for them.
void check(const RenderSettings& settings);

/// A renderer of one scene. Later renderers reuse its OpenGL context. Use it from one thread at a time.
class Renderer {
 public:
  /// `reference`: the poses of all frames, from which a scene without a camera gets one that sees them all;
  /// empty: the scene's initial poses serve.
  Renderer(const Scene& scene, const RenderSettings& settings,
           std::span<const std::vector<Coordinates>> reference = {});
  ~Renderer();

  const View& view() const;
  /// Changes the view of the next pictures.
  void change_view(const View& view);

  /// Returns whether a point of a body moves in the picture by `pixels` or more between two sets of poses.
  bool moves_by(double pixels, std::span<const Coordinates> from, std::span<const Coordinates> to) const;

  /// Draws the frame with bodies at `poses` (one per body of the scene, the world first).
  Image draw(std::span<const Coordinates> poses);

  /// Draws each pixel's body as a colour (red + 256 green + 65536 blue = body index + 1; 0 is the sky): no
  /// light, no anti-aliasing.
  Image draw_bodies(std::span<const Coordinates> poses);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Draws the last of `moments` (at least two, each the poses of all bodies), and in it the bodies of the
/// others, lighter for earlier moments. Later moments cover earlier ones. Throws Error where the picture is
/// too large: its outlines are taken from one of twice its size.
Image strobe(const Scene& scene, const RenderSettings& settings,
             std::span<const std::vector<Coordinates>> moments);

}  // namespace substep::render
