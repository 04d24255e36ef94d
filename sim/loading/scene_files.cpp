#include "sim/loading/scene_files.h"

#include "sim/loading/file_bytes.h"
#include "sim/loading/gltf_document.h"

namespace substep {

std::vector<std::filesystem::path> scene_files(const std::filesystem::path& file) {
  std::vector<std::filesystem::path> result{file};
  const std::string extension = lower_extension(file);
  if (extension != ".gltf" && extension != ".glb") return result;
  const GltfDocument document = read_gltf(file);
  result.insert(result.end(), document.buffer_files.begin(), document.buffer_files.end());
  return result;
}

}  // namespace substep
