#include "sim/loading/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "sim/error.h"
#include "sim/loading/file_bytes.h"
#include "sim/loading/parse_json.h"
#include "sim/math/base64.h"
#include "sim/math/fnv1a.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_json = std::size_t{1}
                                     << 27;  // the parsed document takes about 16 times as much
constexpr int deepest_json = 64;
constexpr int deepest_node = 256;
constexpr std::array<const char*, 6> known_extensions{
    "KHR_implicit_shapes",   "KHR_physics_rigid_bodies", "KHR_lights_punctual",
    "KHR_texture_transform", "KHR_materials_unlit",      "KHR_materials_emissive_strength"};

std::uint32_t little_endian(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
  return value;
}

struct Container {
  std::string_view json;
  std::optional<std::string_view> binary;
};

Container split_glb(std::string_view bytes, const std::string& file_name) {
  if (bytes.size() < 12) {
    throw Error(fmt::format("{}: has {} bytes, less than a .glb's header: the file is cut short", file_name,
                            bytes.size()));
  }
  if (bytes.substr(0, 4) != "glTF") {
    throw Error(file_name + ": does not begin with 'glTF', so it is not a .glb file");
  }
  if (const std::uint32_t version = little_endian(bytes, 4); version != 2) {
    throw Error(fmt::format("{}: is of glTF version {}; only version 2 is read", file_name, version));
  }
  if (const std::uint32_t length = little_endian(bytes, 8); length != bytes.size()) {
    throw Error(fmt::format("{}: its header says {} bytes, but it has {}: the file is {}", file_name, length,
                            bytes.size(), length > bytes.size() ? "cut short" : "damaged"));
  }
  Container container;
  std::size_t offset = 12;
  for (int chunk = 0; offset < bytes.size(); ++chunk) {
    if (bytes.size() - offset < 8) {
      throw Error(fmt::format("{}: chunk {} has no whole header at byte {}", file_name, chunk, offset));
    }
    const std::uint32_t length = little_endian(bytes, offset);
    const std::string_view type = bytes.substr(offset + 4, 4);
    offset += 8;
    if (length > bytes.size() - offset) {
      throw Error(fmt::format("{}: chunk {} says {} bytes, but only {} are left: the file is damaged",
                              file_name, chunk, length, bytes.size() - offset));
    }
    const std::string_view content = bytes.substr(offset, length);
    offset += length;
    if (chunk == 0) {
      if (type != "JSON") throw Error(file_name + ": its first chunk is not the JSON chunk");
      container.json = content;
    } else if (chunk == 1 && type == std::string_view("BIN\0", 4)) {
      container.binary = content;
    }
  }
  if (container.json.data() == nullptr) throw Error(file_name + ": has no JSON chunk");
  return container;
}

// Limit the nesting: the parser keeps its own stack, but code that reads the document recurses.
void check_nesting(std::string_view text, const std::string& file_name) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') {
        ++i;
      } else if (c == '"') {
        in_string = false;
      }
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > deepest_json) {
        throw Error(fmt::format("{}: its JSON is nested deeper than {} levels at byte {}", file_name,
                                deepest_json, i));
      }
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

nlohmann::json parse(std::string_view text, const std::string& file_name) {
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) throw Error(file_name + ": is empty");
  if (text.size() > largest_json) {
    throw Error(
        fmt::format("{}: has {} bytes of JSON; the most that is read is {}: keep buffers in files beside it",
                    file_name, text.size(), largest_json));
  }
  check_nesting(text, file_name);
  try {
    nlohmann::json json = parse_json<nlohmann::json>(text, file_name);
    if (!json.is_object()) throw Error(file_name + ": is JSON, but not an object: not a glTF file");
    return json;
  } catch (const nlohmann::json::exception& failure) {
    std::string reason = failure.what();
    if (const std::size_t end = reason.find("] "); end != std::string::npos) reason.erase(0, end + 2);
    throw Error(fmt::format("{}: is not valid JSON: {}", file_name, reason));
  }
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percent_decoded(const JsonValue& uri) {
  const std::string& text = uri.text();
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
      if (high < 0 || low < 0) uri.fail("has a '%' that two hexadecimal digits do not follow");
      c = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (static_cast<unsigned char>(c) < 0x20) uri.fail("has a control character");
    decoded += c;
  }
  return decoded;
}

bool is_data(const JsonValue& uri) {
  return uri.text().compare(0, 5, "data:") == 0;
}

std::shared_ptr<const std::string> read_data(const JsonValue& uri, GltfDocument& document) {
  const std::string& text = uri.text();
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) uri.fail("is a data URI without a comma before its data");
  constexpr std::string_view marker = ";base64";
  if (comma < marker.size() || text.compare(comma - marker.size(), marker.size(), marker) != 0) {
    uri.fail("is a data URI that is not base64, the only coding read");
  }
  std::optional<char> stranger;
  std::string bytes = base64_decoded(std::string_view(text).substr(comma + 1), stranger);
  if (stranger) {
    uri.fail(fmt::format("has a byte that is not base64 (code {})", static_cast<unsigned char>(*stranger)));
  }
  return document.files.emplace_back(std::make_shared<const std::string>(std::move(bytes)));
}

std::string file_name_of(const JsonValue& uri) {
  if (uri.text().find("://") != std::string::npos)
    uri.fail("is a network address; only files and data URIs are read");
  std::string name = percent_decoded(uri);
  if (name.empty()) uri.fail("is empty");
  return name;
}

void read_buffers(GltfDocument& document, std::optional<std::string_view> binary) {
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < document.size_of("buffers"); ++i) {
    const JsonValue buffer = document.item_of("buffers", static_cast<int>(i));
    const std::uint64_t length = buffer.require("byteLength").integer(largest_file);
    total += length;
    if (total > largest_file) {
      buffer.fail(
          fmt::format("the buffers together have more than {} bytes, the most that is read", largest_file));
    }
    std::string_view bytes;
    if (const std::optional<JsonValue> uri = buffer.find("uri")) {
      const std::optional<UriBytes> read = read_uri(*uri, document);
      if (!read) uri->fail(fmt::format("there is no file '{}' beside the scene", percent_decoded(*uri)));
      bytes = *read->bytes;
      if (read->is_new_file) document.hash = add_binary_to_hash(document.hash, bytes);
    } else if (i == 0 && binary) {
      bytes = *binary;
    } else {
      buffer.fail("has no 'uri', and the file has no binary chunk for it");
    }
    if (bytes.size() < length) {
      buffer.fail(fmt::format("says {} bytes, but there are only {}", length, bytes.size()));
    }
    document.buffers.push_back(bytes.substr(0, static_cast<std::size_t>(length)));
  }
}

void check_extensions(const JsonValue& root) {
  const std::optional<JsonValue> required = root.find("extensionsRequired");
  if (!required) return;
  for (const JsonValue& name : required->items()) {
    if (std::find(known_extensions.begin(), known_extensions.end(), name.text()) == known_extensions.end()) {
      name.fail(fmt::format("the file needs the extension '{}', which is not read; known are {}", name.text(),
                            fmt::join(known_extensions, ", ")));
    }
  }
}

NodeTransform read_transform(const JsonValue& node) {
  const std::optional<JsonValue> matrix = node.find("matrix");
  if (matrix) {
    for (const char* key : {"translation", "rotation", "scale"}) {
      if (node.find(key)) node.fail(fmt::format("has both 'matrix' and '{}'", key));
    }
    const std::vector<JsonValue> entries = matrix->items();
    if (entries.size() != 16) matrix->fail("must be an array of 16 numbers");
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) m(i % 4, i / 4) = entries[i].number();
    if (m.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) matrix->fail("its last row must be 0 0 0 1");
    return make_transform(Matrix3(m.topLeftCorner<3, 3>()), Vector3(m.topRightCorner<3, 1>()));
  }
  return make_transform(get(node, "translation", Vector3(0, 0, 0), &JsonValue::vector3),
                        get(node, "rotation", Quaternion(1, 0, 0, 0), &JsonValue::rotation),
                        get(node, "scale", Vector3(1, 1, 1), &JsonValue::vector3));
}

void read_nodes(GltfDocument& document) {
  const std::size_t count = document.size_of("nodes");
  document.nodes.resize(count);
  std::set<std::string> names{"world"};  // of body 0
  std::map<std::string, int> uses;
  for (std::size_t i = 0; i < count; ++i) {
    const JsonValue json = document.node_json(static_cast<int>(i));
    GltfNode& node = document.nodes[i];
    const std::string base = json.name(fmt::format("node {}", i));
    node.name = base;
    for (int& use = uses.try_emplace(base, 1).first->second; !names.insert(node.name).second;) {
      node.name = fmt::format("{} #{}", base, ++use);
    }
    node.local = read_transform(json);
    if (!node.local.is_finite()) json.fail("its transform overflows");
    if (const auto mesh = json.find("mesh")) node.mesh = mesh->index(document.size_of("meshes"), "mesh");
    if (const auto skin = json.find("skin")) {
      node.skin = skin->index(document.size_of("skins"), "skin");
    }
    if (const auto children = json.find("children")) {
      for (const JsonValue& child : children->items()) {
        const int index = child.index(count, "node");
        if (document.nodes[index].parent >= 0) {
          child.fail(fmt::format("node {} has two parents: it is also a child of node {}", index,
                                 document.nodes[index].parent));
        }
        document.nodes[index].parent = static_cast<int>(i);
        node.children.push_back(index);
      }
    }
  }
}

void place_nodes(GltfDocument& document) {
  // Every node has one parent at most, so what no root leads to lies on, or below, a cycle.
  std::vector<bool> placed(document.nodes.size(), false);
  std::vector<std::pair<int, int>> pending;  // node, depth
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    if (document.nodes[i].parent < 0) pending.emplace_back(static_cast<int>(i), 1);
  }
  while (!pending.empty()) {
    const auto [index, depth] = pending.back();
    pending.pop_back();
    const JsonValue json = document.node_json(index);
    if (depth > deepest_node) json.fail(fmt::format("lies deeper than {} levels of nodes", deepest_node));
    GltfNode& node = document.nodes[index];
    placed[index] = true;
    node.world = node.parent < 0 ? node.local : compose(document.nodes[node.parent].world, node.local);
    if (!node.world.is_finite()) json.fail("its transform overflows");
    for (const int child : node.children) pending.emplace_back(child, depth + 1);
  }
  const auto lost = std::find(placed.begin(), placed.end(), false);
  if (lost != placed.end()) {
    document.node_json(static_cast<int>(lost - placed.begin()))
        .fail("is its own ancestor: the nodes form a cycle");
  }
}

void choose_scene(GltfDocument& document) {
  const JsonValue root = document.root();
  const std::size_t scenes = document.size_of("scenes");
  std::vector<int> pending;
  if (const auto scene = root.find("scene")) {
    document.scene = scene->index(scenes, "scene");
  } else if (scenes > 0) {
    document.scene = 0;
  }
  if (document.scene >= 0) {
    const auto nodes = document.item_of("scenes", document.scene).find("nodes");
    for (const JsonValue& node : nodes ? nodes->items() : std::vector<JsonValue>{}) {
      const int index = node.index(document.nodes.size(), "node");
      if (document.nodes[index].parent >= 0) {
        node.fail(fmt::format("node {} is not a root: it is a child of node {}", index,
                              document.nodes[index].parent));
      }
      pending.push_back(index);
    }
  } else {
    for (std::size_t i = 0; i < document.nodes.size(); ++i) {
      if (document.nodes[i].parent < 0) pending.push_back(static_cast<int>(i));
    }
  }
  while (!pending.empty()) {
    GltfNode& node = document.nodes[pending.back()];
    pending.pop_back();
    node.in_scene = true;
    pending.insert(pending.end(), node.children.begin(), node.children.end());
  }
}

}  // namespace

JsonValue GltfDocument::node_json(int node) const {
  return item_of("nodes", node);
}

std::size_t GltfDocument::size_of(const char* list) const {
  const auto found = json.find(list);
  return found != json.end() && found->is_array() ? found->size() : 0;
}

JsonValue GltfDocument::item_of(const char* list, int index) const {
  return {json.at(list).at(static_cast<std::size_t>(index)), file_name, fmt::format("/{}/{}", list, index)};
}

std::optional<fs::path> file_of_uri(const JsonValue& uri, const GltfDocument& document) {
  if (is_data(uri)) return std::nullopt;
  const std::string name = file_name_of(uri);
  bool leaves = false;
  std::optional<fs::path> found = file_beside(document.file, name, leaves);
  if (leaves) {
    uri.fail(fmt::format("'{}' leaves the scene's folder; only files in it or below are read", name));
  }
  return found;
}

std::optional<UriBytes> read_uri(const JsonValue& uri, GltfDocument& document) {
  if (is_data(uri)) return UriBytes{read_data(uri, document)};
  const std::optional<fs::path> found = file_of_uri(uri, document);
  if (!found) return std::nullopt;
  const auto [file, is_new] = document.files_beside.try_emplace(*found);
  if (is_new) {
    const std::string name = (document.file.parent_path() / percent_decoded(uri)).string();
    file->second = std::make_shared<const std::string>(read_bytes(*found, name));
    document.files.push_back(file->second);
  }
  return UriBytes{file->second, is_new};
}

std::string_view buffer_view(const GltfDocument& document, int index) {
  const JsonValue view = document.item_of("bufferViews", index);
  const std::string_view buffer =
      document.buffers[view.require("buffer").index(document.buffers.size(), "buffer")];
  const auto offset = view.find("byteOffset");
  const std::uint64_t begin = offset ? offset->integer(std::uint64_t{1} << 40) : 0;
  const std::uint64_t length = view.require("byteLength").integer(std::uint64_t{1} << 40);
  if (begin + length > buffer.size()) {
    view.fail(fmt::format("ends at byte {}, but its buffer has {}", begin + length, buffer.size()));
  }
  return buffer.substr(begin, length);
}

GltfDocument read_gltf(const fs::path& file) {
  GltfDocument document;
  document.file = file;
  document.file_name = file.string();
  const std::string extension = lower_extension(file);
  document.files.push_back(std::make_shared<const std::string>(read_bytes(file, document.file_name)));
  const std::string& bytes = *document.files.back();
  if (bytes.empty()) throw Error(document.file_name + ": is empty");
  Container container{bytes, std::nullopt};
  if (extension == ".glb") {
    document.hash = add_binary_to_hash(fnv1a_start, bytes);
    container = split_glb(bytes, document.file_name);
  } else {
    document.hash = fnv1a(bytes);
  }
  document.json = parse(container.json, document.file_name);

  const JsonValue root = document.root();
  const std::string& version = root.require("asset").require("version").text();
  if (version.compare(0, 2, "2.") != 0) {
    root.require("asset").require("version").fail(
        fmt::format("is '{}'; only glTF version 2 is read", printable(version)));
  }
  check_extensions(root);
  for (const char* list : {"accessors", "bufferViews", "buffers", "cameras", "images", "materials", "meshes",
                           "nodes", "samplers", "scenes", "skins", "textures"}) {
    if (const auto value = root.find(list); value && !value->json().is_array())
      value->fail("must be an array");
  }
  read_buffers(document, container.binary);
  read_nodes(document);
  place_nodes(document);
  choose_scene(document);
  return document;
}

}  // namespace substep
