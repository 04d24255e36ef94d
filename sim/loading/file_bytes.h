#pragma once
/// Input files as bytes, and the names in them.

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace substep {

inline constexpr std::uintmax_t largest_file = std::uintmax_t{1} << 30;

/// Returns the content of a regular file of at most `most` bytes. Throws Error that begins with `complaint`.
std::string read_bytes(const std::filesystem::path& file, const std::string& complaint,
                       std::uintmax_t most = largest_file);

/// Returns `hash` continued as FNV-1a by the 8 bytes, lowest first, of XXH3 of `bytes`: hashing a buffer byte
/// by byte takes longer than reading it.
std::uint64_t add_binary_to_hash(std::uint64_t hash, std::string_view bytes);

/// Returns the unsigned number of `size` bytes, up to 4, whose lowest byte comes first.
inline std::uint32_t little_endian(const char* bytes, std::uint64_t size) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes, size);
  return value;
}

/// Returns the extension in lower case, with its dot.
std::string lower_extension(const std::filesystem::path& file);

/// Returns the real path of the file `name` in the folder of `beside` or below, or nothing. `leaves` is then
/// true where the name, or a symbolic link, leads elsewhere.
std::optional<std::filesystem::path> file_beside(const std::filesystem::path& beside, const std::string& name,
                                                 bool& leaves);

/// Returns the name with spaces in place of control characters, since pose logs have one name a line.
std::string printable(std::string name);

/// Names of bodies, of which no two are equal and none is the world's.
class UniqueNames {
 public:
  /// Returns `base`, with the first of " #2", " #3" … appended that is not taken where `base` is.
  std::string add(const std::string& base);

 private:
  std::map<std::string, int> uses_{{"world", 1}};  ///< of each name that is taken, as a base
};

}  // namespace substep
