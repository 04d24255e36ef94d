#include "sim/loading/gltf_document.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "sim/loading/file_bytes.h"
#include "sim/math/base64.h"
#include "sim/math/fnv1a.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_json = std::size_t{1} << 27;  // the parsed document takes 16 times as much
constexpr std::uint64_t largest_length = std::uint64_t{1} << 40;
constexpr std::array<const char*, 6> known_extensions{
    "KHR_implicit_shapes",   "KHR_physics_rigid_bodies", "KHR_lights_punctual",
    "KHR_texture_transform", "KHR_materials_unlit",      "KHR_materials_emissive_strength"};

/// The chunks of a .glb file.
struct Container {
  std::string_view json;
  std::optional<std::string_view> binary;
};

Container split_glb(std::string_view bytes, const std::string& file_name) {
  const auto require = [&](bool condition, const std::string& what) {
    if (!condition) throw Error(file_name + ": " + what);
  };
  require(bytes.size() >= 12,
          fmt::format("has {} bytes, less than a .glb's header: the file is cut short", bytes.size()));
  require(bytes.starts_with("glTF"), "does not begin with 'glTF', so it is not a .glb file");
  const auto number_at = [&](std::size_t offset) { return little_endian(bytes.data() + offset, 4); };
  require(number_at(4) == 2, fmt::format("is of glTF version {}; only version 2 is read", number_at(4)));
  require(number_at(8) == bytes.size(),
          fmt::format("its header says {} bytes, but it has {}: the file is {}", number_at(8), bytes.size(),
                      number_at(8) > bytes.size() ? "cut short" : "damaged"));
  Container container;
  std::size_t offset = 12;
  for (int chunk = 0; offset < bytes.size(); ++chunk) {
    require(bytes.size() - offset >= 8,
            fmt::format("chunk {} has no whole header at byte {}", chunk, offset));
    const std::uint32_t length = number_at(offset);
    const std::string_view type = bytes.substr(offset + 4, 4);
    offset += 8;
    require(length <= bytes.size() - offset,
            fmt::format("chunk {} says {} bytes, but only {} are left: the file is damaged", chunk, length,
                        bytes.size() - offset));
    const std::string_view content = bytes.substr(offset, length);
    offset += length;
    require(chunk != 0 || type == "JSON", "its first chunk is not the JSON chunk");
    if (chunk == 0) container.json = content;
    if (chunk == 1 && type == std::string_view("BIN\0", 4)) container.binary = content;
  }
  require(container.json.data() != nullptr, "has no JSON chunk");
  return container;
}

Json parse(std::string_view text, const std::string& file_name) {
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) throw Error(file_name + ": is empty");
  if (text.size() > largest_json) {
    throw Error("{}: has {} bytes of JSON; the most that is read is {}: keep buffers in files beside it",
                file_name, text.size(), largest_json);
  }
  try {
    Json json = parse_json(text, file_name);
    if (!json.is_object()) throw Error(file_name + ": is JSON, but not an object: not a glTF file");
    return json;
  } catch (const Json::exception& failure) {
    std::string reason = failure.what();
    if (const std::size_t end = reason.find("] "); end != std::string::npos) reason.erase(0, end + 2);
    throw Error("{}: is not valid JSON: {}", file_name, reason);
  }
}

std::string percent_decoded(const JsonValue& uri) {
  const std::string& text = uri.text();
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    auto byte = static_cast<unsigned char>(text[i]);
    if (byte == '%') {
      const char* const digits = text.data() + i + 1;
      if (i + 2 >= text.size() || std::from_chars(digits, digits + 2, byte, 16).ptr != digits + 2) {
        uri.fail("has a '%' that two hexadecimal digits do not follow");
      }
      i += 2;
    }
    if (byte < 0x20) uri.fail("has a control character");
    decoded += static_cast<char>(byte);
  }
  return decoded;
}

bool is_data(const JsonValue& uri) {
  return uri.text().starts_with("data:");
}

std::string data_of(const JsonValue& uri) {
  const std::string_view text = uri.text();
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos) uri.fail("is a data URI without a comma before its data");
  if (!text.substr(0, comma).ends_with(";base64")) {
    uri.fail("is a data URI that is not base64, the only coding read");
  }
  std::optional<char> invalid;
  std::string bytes = base64_decoded(text.substr(comma + 1), invalid);
  if (invalid) uri.fail("has a byte that is not base64 (code {})", static_cast<unsigned char>(*invalid));
  return bytes;
}

void read_buffers(GltfDocument& document, std::optional<std::string_view> binary) {
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < document.size_of("buffers"); ++i) {
    const JsonValue buffer = document.item_of("buffers", i);
    const std::uint64_t length = buffer.require("byteLength").integer(largest_file);
    total += length;
    if (total > largest_file) {
      buffer.fail("the buffers together have more than {} bytes, the most that is read", largest_file);
    }
    std::string_view bytes;
    if (const auto uri = buffer.find("uri")) {
      const auto read = read_uri(*uri, document);
      if (!read) uri->fail("there is no file '{}' beside the scene", percent_decoded(*uri));
      bytes = *read;
    } else if (i == 0 && binary) {
      bytes = *binary;
    } else {
      buffer.fail("has no 'uri', and the file has no binary chunk for it");
    }
    if (bytes.size() < length) buffer.fail("says {} bytes, but there are only {}", length, bytes.size());
    document.buffers.push_back(bytes.substr(0, length));
  }
}

void check_root(const JsonValue& root) {
  const JsonValue version = root.require("asset").require("version");
  if (!version.text().starts_with("2.")) {
    version.fail("is '{}'; only glTF version 2 is read", printable(version.text()));
  }
  const auto is_known = [](const JsonValue& name) {
    return std::ranges::find(known_extensions, name.text()) != known_extensions.end();
  };
  for (const JsonValue& name : root.items("extensionsRequired")) {
    if (is_known(name)) continue;
    name.fail("the file needs the extension '{}', which is not read; known are {}", name.text(),
              fmt::join(known_extensions, ", "));
  }
  for (const JsonValue& name : root.items("extensionsUsed")) {
    if (!is_known(name)) name.warn("the extension '{}' is ignored", printable(name.text()));
  }
  if (const auto animations = root.find("animations")) {
    animations->warn("are ignored: nodes move as bodies or not at all");
  }
  for (const char* list : {"accessors", "bufferViews", "buffers", "cameras", "images", "materials", "meshes",
                           "nodes", "samplers", "scenes", "skins", "textures"}) {
    const auto value = root.find(list);
    if (value && !value->json().is_array()) value->fail("must be an array");
  }
}

}  // namespace

std::size_t GltfDocument::size_of(const char* list) const {
  const auto found = json.find(list);
  return found != json.end() ? found->size() : 0;
}

JsonValue GltfDocument::item_of(const char* list, std::size_t index) const {
  return {json.at(list).at(index), *source, fmt::format("/{}/{}", list, index)};
}

std::optional<fs::path> file_of_uri(const JsonValue& uri, const GltfDocument& document) {
  if (is_data(uri)) return std::nullopt;
  if (uri.text().find("://") != std::string::npos) {
    uri.fail("is a network address; only files and data URIs are read");
  }
  const std::string name = percent_decoded(uri);
  if (name.empty()) uri.fail("is empty");
  bool leaves_folder = false;
  std::optional<fs::path> found = file_beside(document.file, name, leaves_folder);
  if (leaves_folder) uri.fail("'{}' leaves the scene's folder; only files in it or below are read", name);
  return found;
}

std::shared_ptr<const std::string> read_uri(const JsonValue& uri, GltfDocument& document) {
  if (is_data(uri)) return document.files.emplace_back(std::make_shared<const std::string>(data_of(uri)));
  const std::optional<fs::path> found = file_of_uri(uri, document);
  if (!found) return nullptr;
  std::shared_ptr<const std::string>& file = document.files_beside[*found];
  if (!file) {
    const std::string name = (document.file.parent_path() / percent_decoded(uri)).string();
    file = document.files.emplace_back(std::make_shared<const std::string>(read_bytes(*found, name)));
    document.hash = add_binary_to_hash(document.hash, *file);
  }
  return file;
}

std::string_view buffer_view(const GltfDocument& document, const JsonValue& reference) {
  const JsonValue view = document.target_of(reference, "bufferViews", "buffer view");
  const std::string_view buffer =
      document.buffers[view.require("buffer").index(document.buffers.size(), "buffer")];
  const auto offset = view.find("byteOffset");
  const std::uint64_t begin = offset ? offset->integer(largest_length) : 0;
  const std::uint64_t end = begin + view.require("byteLength").integer(largest_length);
  if (end > buffer.size()) view.fail("ends at byte {}, but its buffer has {}", end, buffer.size());
  return buffer.substr(begin, end - begin);
}

GltfDocument read_gltf(const fs::path& file) {
  GltfDocument document;
  document.file = file;
  const std::string& name = document.source->name = file.string();
  document.files.push_back(std::make_shared<const std::string>(read_bytes(file, name)));
  const std::string& bytes = *document.files.back();
  if (bytes.empty()) throw Error(name + ": is empty");
  const bool is_binary = lower_extension(file) == ".glb";
  document.hash = is_binary ? add_binary_to_hash(fnv1a_start, bytes) : fnv1a(bytes);
  const Container container = is_binary ? split_glb(bytes, name) : Container{bytes, std::nullopt};
  document.json = parse(container.json, name);
  check_root(document.root());
  read_buffers(document, container.binary);
  read_nodes(document);
  return document;
}

}  // namespace substep
