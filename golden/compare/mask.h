#pragma once
/// Parts of a picture that are judged apart from the rest: by a tolerance of their own, or not at all.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "golden/compare/image_comparison.h"
#include "render/image.h"

namespace substep {

struct PixelBox {
  int left = 0, top = 0, width = 0, height = 0;  ///< pixels, from the top left
};

/// A rectangle, or the pixels that show a body in the golden poses and those next to them: an edge is blended
/// over two pixels. A shadow is not the body's.
struct Mask {
  std::optional<PixelBox> box;
  std::string body;  ///< where there is no box
  std::string reason;
  /// Of the masked pixels; its `hard`, `level` and `count` hold. None: they may differ by anything.
  std::optional<ImageTolerance> tolerance;

  std::string text() const;  ///< "body rotor", "box [0, 0, 60, 20]"
};

/// What a mask covers of a picture.
struct MaskedPart {
  std::string what;  ///< Mask::text()
  std::string reason;
  std::int64_t pixels = 0;
  std::int64_t differing = 0;
  int max = 0;  ///< largest difference of a channel, levels
  bool passes = true;
  std::string above;  ///< "7 px > 3 levels", where it has a tolerance of its own
  std::string limit;  ///< "20 px > 3 levels, none > 64": what may differ

  std::string found() const;  ///< "12 of 812 px differ, most by 40 levels"
  std::string text() const;   ///< the same with what and why, and whether that is within the tolerance
};

struct MaskedPicture {
  Image expected;
  Image bodies;  ///< with `masked_body` where it is masked and passes
  std::vector<MaskedPart> parts;
};

/// `expected` with what is masked and passes as in `actual`, so that a comparison of the two says nothing of
/// it. All images have one size; `bodies` is that of Renderer::draw_bodies(), `names` are the scene's. Throws
/// Error when the masks leave nothing to compare.
MaskedPicture masked(const Image& expected, const Image& actual, const Image& bodies,
                     std::span<const Mask> masks, const std::vector<std::string>& names);

}  // namespace substep
