#pragma once
/// Surfaces of a scene as materials of a glTF file.

#include <map>

#include "render/glb_writer.h"
#include "sim/scene/scene.h"

namespace substep::render {

class GlbMaterials {
 public:
  /// Both must outlive it.
  GlbMaterials(GlbWriter& writer, const Scene& scene) : writer_(writer), scene_(scene) {}

  /// The material's index, the same for equal surfaces; with its textures, whose images are stored once.
  int add(const Surface& surface);

 private:
  /// What a material says of a texture; null where there is none.
  GlbWriter::Json reference(const Texture& texture);

  GlbWriter& writer_;
  const Scene& scene_;
  std::map<int, int> images_;  ///< by Scene's index, the file's
};

}  // namespace substep::render
