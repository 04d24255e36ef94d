#include "golden/compare/provenance.h"

#include <fmt/format.h>

#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "render/renderer.h"
#include "sim/error.h"
#include "sim/math/fnv1a.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) != 0) continue;
    const auto start = line.find_first_not_of(" \t", line.find(':') + 1);
    return start == std::string::npos ? std::string() : line.substr(start);
  }
  return {};
}

/// "debian-12", as the system calls itself.
std::string operating_system() {
  std::ifstream file("/etc/os-release");
  std::string id;
  std::string version;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("ID=")) id = line.substr(3);
    if (line.starts_with("VERSION_ID=")) version = line.substr(11);
  }
  return fmt::format("{} {}", id, version);
}

/// Small letters and digits, with one hyphen for whatever is between them.
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
    result.renderer = render::renderer_description();
    result.is_pinned = render::is_pinned_renderer();
    result.platform = as_word(result.renderer + " " + operating_system());
  }
  result.compiler = SUBSTEP_COMPILER;
  result.processor = processor();
  return result;
}

std::string content_hash(std::string_view bytes) {
  return fmt::format("{:016x}", fnv1a(bytes));
}

std::string read_bytes(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)));
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) throw Error(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)));
  return bytes;
}

}  // namespace substep::golden
