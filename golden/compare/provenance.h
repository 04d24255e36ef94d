#pragma once
/// The provenance of goldens: renderer, compiler and processor.

#include <filesystem>
#include <string>
#include <string_view>

namespace substep::golden {

struct MadeWith {
  std::string renderer;    ///< renderer_description(); empty when nothing was drawn
  bool is_pinned = false;  ///< whether that is the renderer that goldens are exact on
  std::string platform;    ///< renderer and system as one word: what pictures are exact on
  std::string compiler;    ///< "GNU 12.2.0"
  std::string processor;   ///< as the system names it
};

/// Returns the provenance of goldens made here. Starts the renderer only where `with_renderer`.
MadeWith made_with(bool with_renderer);

/// Returns 16 hexadecimal digits of the 64-bit FNV-1a of bytes, which detects changes but no forgery.
std::string content_hash(std::string_view bytes);

/// Returns the file's content. Throws Error.
std::string read_bytes(const std::filesystem::path& file);

}  // namespace substep::golden
