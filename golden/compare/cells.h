#pragma once
/// Numbers of four cells at once, neighbours in a row of pixels, by the compiler's vector extension, and the
/// functions that FLIP needs of them. Only operations that IEEE 754 defines to the last bit, so that figures
/// are the same on every machine.

#include <cmath>
#include <cstdint>
#include <cstring>

namespace substep::golden::cells {

using Floats = float __attribute__((vector_size(16)));
using Ints = std::int32_t __attribute__((vector_size(16)));
constexpr int width = 4;

inline Floats load(const float* from) {
  Floats value;
  std::memcpy(&value, from, sizeof value);
  return value;
}
inline void store(float* to, Floats value) {
  std::memcpy(to, &value, sizeof value);
}
inline Floats all(float value) {
  return Floats{value, value, value, value};
}
inline Ints bits(Floats value) {
  Ints result;
  std::memcpy(&result, &value, sizeof result);
  return result;
}
inline Floats from_bits(Ints value) {
  Floats result;
  std::memcpy(&result, &value, sizeof result);
  return result;
}

/// Where `mask` is all ones, `yes`.
inline Floats choose(Ints mask, Floats yes, Floats no) {
  return from_bits((mask & bits(yes)) | (~mask & bits(no)));
}
inline Floats max(Floats a, Floats b) {
  return choose(a > b, a, b);
}
inline Floats min(Floats a, Floats b) {
  return choose(a < b, a, b);
}
inline Floats absolute(Floats a) {
  return from_bits(bits(a) & 0x7fffffff);
}
inline Floats root(Floats a) {
  return Floats{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}

/// Of positive normal numbers, to three units in the last place: the reciprocal's guess from the exponent,
/// then Newton, which needs no division.
inline Floats cube_root(Floats a) {
  // A third of the exponent; in float, for there is no vector division of integers.
  const Floats third = __builtin_convertvector(bits(a), Floats) * (1.0F / 3);
  Floats x = from_bits(0x54a21d2a - __builtin_convertvector(third, Ints));
  const Floats a_third = a * (1.0F / 3);
  for (int i = 0; i < 3; ++i) x = x * (4.0F / 3 - a_third * (x * x * x));
  return a * (x * x);
}

/// log₂ of positive normal numbers, to about 1e-7 absolute: 2/ln 2 · artanh((m − 1)/(m + 1)) for m in [√½,
/// √2).
inline Floats log2(Floats a) {
  const Ints shifted = bits(a) - 0x3f3504f3;
  const Ints exponent = shifted >> 23;
  const Floats m = from_bits((shifted & 0x007fffff) + 0x3f3504f3);
  const Floats s = (m - 1) / (m + 1);
  const Floats z = s * s;
  const Floats series = 1 + z * (1.0F / 3 + z * (1.0F / 5 + z * (1.0F / 7 + z * (1.0F / 9))));
  return __builtin_convertvector(exponent, Floats) + 2.885390082F * s * series;
}

/// 2ˣ for x in [−126, 126]: Taylor's series of the fraction, in [−½, ½].
inline Floats exp2(Floats x) {
  // Rounds to the nearest whole number.
  const Floats magic = all(12582912.0F);
  const Floats whole = (x + magic) - magic;
  const Floats t = (x - whole) * 0.6931471806F;
  const Floats series =
      1 + t * (1 + t * (0.5F + t * (1.0F / 6 + t * (1.0F / 24 + t * (1.0F / 120 + t * (1.0F / 720))))));
  return series * from_bits((__builtin_convertvector(whole, Ints) + 127) << 23);
}

/// aᵇ for 0 ≤ a and 0 ≤ b ≤ 1.
inline Floats power(Floats a, Floats b) {
  constexpr float smallest = 1e-37F;
  const Floats result = exp2(b * log2(max(a, all(smallest))));
  return choose(a > 0, result, choose(b > 0, all(0), all(1)));
}

}  // namespace substep::golden::cells
