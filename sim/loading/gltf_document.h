#pragma once
/// A glTF file, read and checked: its JSON, its nodes, its buffers' bytes.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/loading/gltf_nodes.h"
#include "sim/loading/json_value.h"

namespace substep {

/// A document, which is never copied, since `buffers` point into `files`.
struct GltfDocument {
  std::filesystem::path file;
  std::unique_ptr<JsonFile> source = std::make_unique<JsonFile>();  ///< outlives moves of the document
  std::uint64_t hash = 0;  ///< of the file and of those beside it that were read; data URIs are in the JSON
  Json json;
  std::vector<std::string_view> buffers;                  ///< each of its declared length, in `files`
  std::vector<std::shared_ptr<const std::string>> files;  ///< contents of all files and data URIs
  std::map<std::filesystem::path, std::shared_ptr<const std::string>> files_beside;
  std::vector<GltfNode> nodes;
  std::vector<int> parents_first;  ///< all nodes, each after its parent
  int scene = -1;  ///< the default scene; −1 where the file lists none, which makes all roots the scene

  JsonValue root() const { return {json, *source}; }
  std::size_t size_of(const char* list) const;  ///< length of a list at the root, 0 for an absent one
  JsonValue item_of(const char* list, std::size_t index) const;
  /// Returns `reference` as an index into a list at the root. Messages call the items `what`.
  int index_of(const JsonValue& reference, const char* list, const char* what) const {
    return reference.index(size_of(list), what);
  }
  /// Returns the item whose index is `reference`.
  JsonValue target_of(const JsonValue& reference, const char* list, const char* what) const {
    return item_of(list, index_of(reference, list, what));
  }
};

/// Reads `.gltf` or `.glb` with all buffers: from the file itself, data URIs, or files below its folder.
/// Checks sizes, nodes, and that every required extension is known. Throws Error.
GltfDocument read_gltf(const std::filesystem::path& file);

/// Returns the bytes of a data URI, or of a file in the document's folder or below, which it reads once.
/// Null where there is no such file. Throws Error.
std::shared_ptr<const std::string> read_uri(const JsonValue& uri, GltfDocument& document);

/// Returns the file that a URI names, where it exists in the document's folder or below.
std::optional<std::filesystem::path> file_of_uri(const JsonValue& uri, const GltfDocument& document);

/// Returns the bytes of the buffer view whose index is `reference`. Throws Error if the view leaves its
/// buffer.
std::string_view buffer_view(const GltfDocument& document, const JsonValue& reference);

}  // namespace substep
