#include "golden/compare/provenance.h"

#include <fmt/format.h>

#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "render/renderer.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

/// Returns the rest of the file's first line that begins with `key`; empty without such a line.
std::string value_of(const char* file, std::string_view key) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with(key)) return line.substr(key.size());
  }
  return {};
}

/// Returns the text's letters, in lower case, and digits, with a hyphen for each run of other characters.
std::string as_word(const std::string& text) {
  std::string word;
  for (const unsigned char c : text) {
    if (std::isalnum(c) != 0) {
      word += static_cast<char>(std::tolower(c));
    } else if (!word.empty() && word.back() != '-') {
      word += '-';
    }
  }
  while (word.ends_with('-')) word.pop_back();
  return word;
}

}  // namespace

MadeWith made_with(bool with_renderer) {
  MadeWith result;
  if (with_renderer) {
    const char* const system = "/etc/os-release";
    result.renderer = render::renderer_description();
    result.is_pinned = render::is_pinned_renderer();
    result.platform = as_word(
        fmt::format("{} {} {}", result.renderer, value_of(system, "ID="), value_of(system, "VERSION_ID=")));
  }
  result.version = SUBSTEP_VERSION;
  result.compiler = SUBSTEP_COMPILER;
  result.processor = value_of("/proc/cpuinfo", "model name");
  result.processor.erase(0, result.processor.find_first_not_of(" \t:"));
  return result;
}

std::string hash_text(std::uint64_t hash) {
  return fmt::format("{:016x}", hash);
}

std::string read_bytes(const std::filesystem::path& file) {
  std::optional<std::string> bytes = content_of(file);
  if (!bytes) throw Error("{}: cannot be read: {}", file.string(), std::strerror(errno));
  return std::move(*bytes);
}

}  // namespace substep::golden
