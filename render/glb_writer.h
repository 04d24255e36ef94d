#pragma once
/// A writer of binary glTF 2.0: nodes, numbers, materials and images, and the JSON that names them.

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/scene.h"

namespace substep::render {

class GlbWriter {
 public:
  using Json = nlohmann::ordered_json;

  GlbWriter();

  Json& root() { return root_; }

  /// Appends an entry to a list of the file and returns its index. All nodes are in the file's one scene.
  int add(const char* list, Json entry);

  /// Adds an accessor; returns its index. `width`: numbers of an element, 1 to 4. `is_attribute`: of
  /// vertices, not of an animation. `has_range`: the accessor has the least and largest numbers.
  int add_floats(const std::vector<float>& values, int width, bool has_range, bool is_attribute);
  int add_indices(const std::vector<std::uint32_t>& indices);

  /// Adds a material unless an equal one is stored; returns its index. Stores each image once.
  int add_material(const Surface& surface, const Scene& scene);

  /// Lists the extension as used.
  void use(const char* extension) { add_once("extensionsUsed", extension); }

  std::string bytes();  ///< returns the file

 private:
  int add_once(const char* list, const Json& entry);
  Json texture_reference(const Texture& texture, const Scene& scene);
  int add_view(std::string_view data, int target);

  Json root_;
  std::string binary_;
  std::map<int, int> images_;  ///< the file's index of each image, by the scene's
};

}  // namespace substep::render
