#include <cmath>

#include "render/renderer.h"

namespace substep::render {
namespace {

/// Returns how many of a pixel's four samples in a picture of twice the size show bodies other than the
/// world.
int covered_samples(const Image& bodies, int x, int y) {
  int count = 0;
  for (const int row : {2 * y, 2 * y + 1}) {
    for (const int column : {2 * x, 2 * x + 1}) {
      const std::uint8_t* const p = bodies.pixel(column, row);
      // Codes of Renderer::draw_bodies(): 0 is the sky, 1 the world.
      count += p[0] + 256 * p[1] + 65536 * p[2] > 1 ? 1 : 0;
    }
  }
  return count;
}

/// Blends `over` into `image` where bodies are.
void blend_bodies(Image& image, const Image& over, const Image& bodies, double strength) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double alpha = strength * covered_samples(bodies, x, y) / 4;
      if (alpha == 0) continue;
      std::uint8_t* const to = image.pixel(x, y);
      const std::uint8_t* const from = over.pixel(x, y);
      for (int c = 0; c < 3; ++c) {
        to[c] = static_cast<std::uint8_t>(std::lround(to[c] + alpha * (from[c] - to[c])));
      }
    }
  }
}

}  // namespace

Image strobe(const Scene& scene, const RenderSettings& settings,
             std::span<const std::vector<Coordinates>> moments) {
  RenderSettings finer = settings;
  finer.width *= 2;
  finer.height *= 2;
  finer.antialiasing = false;
  check(finer);
  Renderer renderer(scene, settings, moments);
  Renderer masks(scene, finer, moments);
  const Image last = renderer.draw(moments.back());
  Image image = last;
  constexpr double faintest = 0.3;
  constexpr double strongest = 0.8;
  const std::size_t earlier = moments.size() - 1;
  for (std::size_t k = 0; k < earlier; ++k) {
    const double fraction = earlier == 1 ? 0.5 : static_cast<double>(k) / static_cast<double>(earlier - 1);
    blend_bodies(image, renderer.draw(moments[k]), masks.draw_bodies(moments[k]),
                 faintest + fraction * (strongest - faintest));
  }
  blend_bodies(image, last, masks.draw_bodies(moments.back()), 1);
  return image;
}

}  // namespace substep::render
