#include "render/glb_writer.h"

#include <algorithm>
#include <array>
#include <utility>

namespace substep::render {
namespace {

// glTF's numbers for OpenGL's constants of these names.
constexpr int type_float = 5126;
constexpr int type_unsigned_int = 5125;
constexpr int array_buffer = 34962;
constexpr int element_array_buffer = 34963;

void append(std::string& file, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) file += static_cast<char>(value >> (8 * i) & 0xff);
}

template <typename Number>
std::string_view bytes_of(const std::vector<Number>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number)};
}

}  // namespace

GlbWriter::GlbWriter() {
  root_["asset"] = {{"version", "2.0"}, {"generator", "substep"}};
  for (const char* const list : {"accessors", "bufferViews", "meshes", "materials", "nodes"}) {
    root_[list] = Json::array();
  }
}

int GlbWriter::add_node(Json node) {
  root_["nodes"].push_back(std::move(node));
  const int index = static_cast<int>(root_["nodes"].size()) - 1;
  roots_.push_back(index);
  return index;
}

int GlbWriter::add_floats(const std::vector<float>& values, int width, bool has_range, bool is_attribute) {
  static constexpr std::array types{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  const auto wide = static_cast<std::size_t>(width);
  Json accessor = {{"bufferView", add_view(bytes_of(values), is_attribute ? array_buffer : 0)},
                   {"componentType", type_float},
                   {"count", values.size() / wide},
                   {"type", types.at(wide)}};
  if (has_range) {
    std::vector<float> low(values.begin(), values.begin() + width);
    std::vector<float> high = low;
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % wide] = std::min(low[i % wide], values[i]);
      high[i % wide] = std::max(high[i % wide], values[i]);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }
  return add_accessor(std::move(accessor));
}

int GlbWriter::add_indices(const std::vector<std::uint32_t>& indices) {
  return add_accessor({{"bufferView", add_view(bytes_of(indices), element_array_buffer)},
                       {"componentType", type_unsigned_int},
                       {"count", indices.size()},
                       {"type", "SCALAR"}});
}

int GlbWriter::add_image(std::string_view bytes) {
  const bool is_png = bytes.starts_with("\x89PNG");
  const Json image = {{"bufferView", add_view(bytes, 0)}, {"mimeType", is_png ? "image/png" : "image/jpeg"}};
  root_["images"].push_back(image);
  return static_cast<int>(root_["images"].size()) - 1;
}

int GlbWriter::add_once(const char* list, const Json& entry) {
  Json& entries = root_[list];
  const auto known = std::ranges::find(entries, entry);
  const auto index = static_cast<int>(known - entries.begin());
  if (known == entries.end()) entries.push_back(entry);
  return index;
}

void GlbWriter::use(const char* extension) {
  add_once("extensionsUsed", extension);
}

std::string GlbWriter::bytes() {
  root_["scene"] = 0;
  root_["scenes"] = Json::array({{{"nodes", roots_}}});
  root_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
  // Names that are not UTF-8 get a replacement character.
  std::string text = root_.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string file = "glTF";
  append(file, std::uint32_t{2});
  append(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary_.size()));
  append(file, static_cast<std::uint32_t>(text.size()));
  file += "JSON" + text;
  append(file, static_cast<std::uint32_t>(binary_.size()));
  file += std::string("BIN\0", 4) + binary_;
  return file;
}

int GlbWriter::add_accessor(Json accessor) {
  root_["accessors"].push_back(std::move(accessor));
  return static_cast<int>(root_["accessors"].size()) - 1;
}

/// Appends bytes as a buffer view. Images are padded to multiples of four bytes, so that views stay aligned.
/// x86-64 stores numbers as glTF does, the lowest byte first.
int GlbWriter::add_view(std::string_view data, int target) {
  Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", data.size()}};
  if (target != 0) view["target"] = target;
  binary_.append(data);
  binary_.resize((binary_.size() + 3) / 4 * 4);
  root_["bufferViews"].push_back(std::move(view));
  return static_cast<int>(root_["bufferViews"].size()) - 1;
}

}  // namespace substep::render
