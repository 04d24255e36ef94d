#pragma once
/// A binary glTF 2.0 file as it is put together: nodes, numbers and images, and the JSON that names them.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace substep::render {

class GlbWriter {
 public:
  using Json = nlohmann::json;

  GlbWriter();

  Json& root() { return root_; }

  /// The node's index; it belongs to the file's one scene.
  int add_node(Json node);

  /// The accessor's index. `width`: numbers of an element, 1 to 4. `is_attribute`: of vertices, not of an
  /// animation. `has_range`: it says its least and largest numbers.
  int add_floats(const std::vector<float>& values, int width, bool has_range, bool is_attribute);
  int add_indices(const std::vector<std::uint32_t>& indices);

  /// The index of the image that these bytes of a PNG or JPEG file are.
  int add_image(std::string_view bytes);

  /// The index of an entry of a list of the file's: the same for equal entries.
  int add_once(const char* list, const Json& entry);

  /// Says that the file uses the extension.
  void use(const char* extension);

  std::string bytes();

 private:
  int add_accessor(Json accessor);
  int add_view(std::string_view data, int target);

  Json root_;
  std::string binary_;
  std::vector<int> roots_;
};

}  // namespace substep::render
