#pragma once
/// A glTF file, read and checked: its JSON, its nodes as a tree, its buffers' bytes.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/loading/json_value.h"
#include "sim/loading/node_transform.h"

namespace substep {

struct GltfNode {
  std::string name;  ///< unique: "node 7" where the file gives none, " #2" appended to the second of a name
  int parent = -1;
  std::vector<int> children;
  bool in_scene = false;  ///< reachable from the default scene
  int mesh = -1;          ///< −1: none
  int skin = -1;          ///< −1: none
  NodeTransform local;
  NodeTransform world;  ///< composed in double precision from the root down
};

/// A document, which is never copied, since `buffers` point into `files`.
struct GltfDocument {
  std::filesystem::path file;
  std::string file_name;  ///< `file` as the complaints name it
  std::uint64_t hash = 0;
  nlohmann::json json;
  std::vector<std::string_view> buffers;                  ///< as long as they say, in `files`
  std::vector<std::shared_ptr<const std::string>> files;  ///< what was read
  std::map<std::filesystem::path, std::shared_ptr<const std::string>>
      files_beside;  ///< those of it that are such
  std::vector<GltfNode> nodes;
  int scene = -1;  ///< the default scene; −1 where the file lists none, which makes all roots the scene

  JsonValue root() const { return {json, file_name}; }
  JsonValue node_json(int node) const;
  std::size_t size_of(const char* list) const;  ///< length of a list at the root, 0 where it is absent
  JsonValue item_of(const char* list, int index) const;
};

/// Reads `.gltf` or `.glb` with all buffers: from the file itself, data URIs, or files below its folder.
/// Checks sizes, nesting, that the nodes form trees at most 256 deep, that their numbers are finite, and that
/// every required extension is one of those modelled. Throws Error.
GltfDocument read_gltf(const std::filesystem::path& file);

/// The bytes that a URI names.
struct UriBytes {
  std::shared_ptr<const std::string> bytes;
  bool is_new_file = false;
};
/// Returns the bytes of a data URI, or of a file in the document's folder or below, which it reads once.
/// Nothing where there is no such file. Throws Error.
std::optional<UriBytes> read_uri(const JsonValue& uri, GltfDocument& document);

/// Returns the file that a URI names, where it exists in the document's folder or below.
std::optional<std::filesystem::path> file_of_uri(const JsonValue& uri, const GltfDocument& document);

/// Returns the bytes of a buffer view. Throws Error where it leaves its buffer.
std::string_view buffer_view(const GltfDocument& document, int index);

}  // namespace substep
