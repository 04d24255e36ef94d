#pragma once
/// 64-bit FNV-1a (Fowler, Noll and Vo), which detects changes of bytes but no forgery. A hash can be
/// continued by passing it as the start of the next.

#include <bit>
#include <cstdint>
#include <string_view>

namespace substep {

/// The hash of no bytes.
inline constexpr std::uint64_t fnv1a_start = 0xcbf29ce484222325;

constexpr std::uint64_t fnv1a(std::string_view bytes, std::uint64_t start = fnv1a_start) {
  std::uint64_t hash = start;
  for (const char byte : bytes) hash = (hash ^ static_cast<std::uint8_t>(byte)) * 0x100000001b3;
  return hash;
}

/// Returns the hash of the lowest `bytes` bytes of a number, the lowest first.
inline std::uint64_t fnv1a_of_number(std::uint64_t number, int bytes, std::uint64_t start) {
  static_assert(std::endian::native == std::endian::little);
  return fnv1a({reinterpret_cast<const char*>(&number), static_cast<std::size_t>(bytes)}, start);
}

}  // namespace substep
