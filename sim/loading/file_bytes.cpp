#include "sim/loading/file_bytes.h"

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <fstream>
#include <system_error>

#include "sim/error.h"
#include "sim/math/fnv1a.h"

namespace substep {

namespace fs = std::filesystem;

std::string read_bytes(const fs::path& file, const std::string& complaint, std::uintmax_t most) {
  std::error_code failure;
  const fs::file_status status = fs::status(file, failure);
  if (status.type() == fs::file_type::not_found) throw Error(complaint + ": there is no such file");
  if (failure) throw Error("{}: cannot be read: {}", complaint, failure.message());
  if (!fs::is_regular_file(status)) throw Error(complaint + ": is not a regular file");
  const std::uintmax_t size = fs::file_size(file, failure);
  if (failure) throw Error("{}: cannot be read: {}", complaint, failure.message());
  if (size > most) throw Error("{}: has {} bytes; the largest file read is {}", complaint, size, most);
  std::ifstream stream(file, std::ios::binary);
  std::string bytes(static_cast<std::size_t>(size), '\0');
  if (!stream || !stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    throw Error(complaint + ": cannot be read; check its permissions");
  return bytes;
}

std::uint64_t add_binary_to_hash(std::uint64_t hash, std::string_view bytes) {
  return fnv1a_of_number(XXH3_64bits(bytes.data(), bytes.size()), 8, hash);
}

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c);
  return extension;
}

std::optional<fs::path> file_beside(const fs::path& beside, const std::string& name, bool& leaves) {
  const fs::path relative(name);
  leaves = relative.is_absolute() || std::find(relative.begin(), relative.end(), "..") != relative.end();
  if (leaves) return std::nullopt;
  const fs::path folder = beside.has_parent_path() ? beside.parent_path() : fs::path(".");
  std::error_code failure;
  const fs::path real_folder = fs::canonical(folder, failure);
  if (failure) return std::nullopt;
  const fs::path real_file = fs::canonical(folder / relative, failure);
  if (failure) return std::nullopt;
  // A symbolic link may lead elsewhere.
  leaves = std::mismatch(real_folder.begin(), real_folder.end(), real_file.begin(), real_file.end()).first !=
           real_folder.end();
  if (leaves) return std::nullopt;
  return real_file;
}

std::string printable(std::string name) {
  for (char& c : name) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return name;
}

std::string UniqueNames::add(const std::string& base) {
  std::string name = base;
  while (!uses_.try_emplace(name, 1).second) name = fmt::format("{} #{}", base, ++uses_[base]);
  return name;
}

}  // namespace substep
