#pragma once
/// Reads the images of a document, and the textures of its materials.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// Reads each image that materials need, once and without decoding it.
class TextureReader {
 public:
  TextureReader(GltfDocument& document, std::vector<SceneImage>& images, std::vector<std::string>& warnings)
      : document_(document), images_(images), warnings_(warnings) {}

  /// Of `object`, the texture that its key names; none where it has no such key, or an image that is not
  /// there or neither PNG nor JPEG, of which a warning tells. Throws Error.
  Texture read(const JsonValue& object, const char* key);

 private:
  int image(int index);
  void set_sampler(const JsonValue& sampler, Texture& texture);

  GltfDocument& document_;
  std::vector<SceneImage>& images_;
  std::vector<std::string>& warnings_;
  std::uint64_t bytes_ = 0;  ///< of all images
  std::map<int, int> read_;  ///< where among `images_` the document's are; −1: nowhere
};

}  // namespace substep
