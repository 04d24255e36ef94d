#pragma once
/// 64-bit FNV-1a (Fowler, Noll and Vo), which detects changes of bytes but no forgery. A hash can be
/// continued by passing it as the start of the next.

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
constexpr std::uint64_t fnv1a_of_number(std::uint64_t number, int bytes, std::uint64_t start) {
  std::uint64_t hash = start;
  for (int i = 0; i < bytes; ++i) {
    const char byte = static_cast<char>(number >> (8 * i) & 0xff);
    hash = fnv1a({&byte, 1}, hash);
  }
  return hash;
}

}  // namespace substep
