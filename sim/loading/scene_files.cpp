#include "sim/loading/scene_files.h"

#include "sim/loading/file_bytes.h"
#include "sim/loading/gltf_document.h"

namespace substep {

std::vector<std::filesystem::path> scene_files(const std::filesystem::path& file) {
  std::vector<std::filesystem::path> result{file};
  const std::string extension = lower_extension(file);
  if (extension != ".gltf" && extension != ".glb") return result;
  const GltfDocument document = read_gltf(file);
  for (const auto& [path, bytes] : document.files_beside) result.push_back(path);
  for (std::size_t i = 0; i < document.size_of("images"); ++i) {
    const auto uri = document.item_of("images", static_cast<int>(i)).find("uri");
    if (const auto image = uri ? file_of_uri(*uri, document) : std::nullopt) result.push_back(*image);
  }
  return result;
}

}  // namespace substep
