#pragma once
/// The provenance of goldens: program, renderer, compiler and processor; and hashes of files and of numbers.

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

#include "sim/math/fnv1a.h"

namespace substep::golden {

struct MadeWith {
  std::string renderer;    ///< renderer_description(); empty when nothing was drawn
  bool is_pinned = false;  ///< whether goldens are exact on this renderer
  std::string platform;    ///< renderer and system as one word; pictures are exact on one platform
  std::string version;     ///< of substep: "0.1.0"
  std::string compiler;    ///< "GNU 12.2.0"
  std::string processor;   ///< as the system names it
};

/// Returns the provenance of goldens made here. Starts the renderer only where `with_renderer`.
MadeWith made_with(bool with_renderer);

/// Returns a hash as 16 hexadecimal digits.
std::string hash_text(std::uint64_t hash);

/// Returns the hash of a file's bytes, which detects changes but no forgery.
inline std::string content_hash(std::string_view bytes) {
  return hash_text(fnv1a(bytes));
}

/// Returns the file's content. Throws Error.
std::string read_bytes(const std::filesystem::path& file);

/// A 64-bit FNV-1a hash of numbers in the order in which they are added, folded to 16 bits.
class Digest {
 public:
  /// Adds numbers, flags, enumerators, and lists and matrices of them. Both zeros are one number.
  template <typename... Values>
  Digest& add(const Values&... values) {
    (add_value(values), ...);
    return *this;
  }

  std::uint16_t value() const {
    return static_cast<std::uint16_t>(hash_ ^ hash_ >> 16 ^ hash_ >> 32 ^ hash_ >> 48);
  }

 private:
  template <typename Value>
  void add_value(const Value& value) {
    if constexpr (std::is_floating_point_v<Value>) {
      const auto number = static_cast<double>(value);
      add_bytes(number == 0 ? 0 : std::bit_cast<std::uint64_t>(number), 8);
    } else if constexpr (std::is_same_v<Value, bool> || std::is_enum_v<Value>) {
      add_bytes(static_cast<std::uint64_t>(value), 1);
    } else if constexpr (std::is_integral_v<Value>) {
      add_bytes(static_cast<std::uint64_t>(value), sizeof(Value));
    } else if constexpr (std::is_base_of_v<Eigen::EigenBase<Value>, Value>) {
      for (Eigen::Index i = 0; i < value.rows(); ++i) {
        for (Eigen::Index k = 0; k < value.cols(); ++k) add_value(value(i, k));
      }
    } else {
      for (const auto& item : value) add_value(item);
    }
  }

  void add_bytes(std::uint64_t number, int count) { hash_ = fnv1a_of_number(number, count, hash_); }

  std::uint64_t hash_ = fnv1a_start;
};

}  // namespace substep::golden
