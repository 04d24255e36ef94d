#pragma once
/// Settings of the processor when the library is entered.

#include <fenv.h>

#include <cfenv>
#include <cstdio>
#include <string_view>

#if defined(__x86_64__)
#include <pmmintrin.h>
#endif

namespace substep {

/// Sets the rounding mode, flush-to-zero or traps by a name: upward, downward, toward-zero, flush-to-zero,
/// trapping. Returns false for another name, or where the processor lacks the mode.
inline bool set_floating_point_mode(std::string_view mode) {
  if (mode == "upward") return std::fesetround(FE_UPWARD) == 0;
  if (mode == "downward") return std::fesetround(FE_DOWNWARD) == 0;
  if (mode == "toward-zero") return std::fesetround(FE_TOWARDZERO) == 0;
  if (mode == "trapping") return feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW) >= 0;
#if defined(__x86_64__)
  if (mode == "flush-to-zero") {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    return true;
  }
#endif
  return false;
}

/// Applies "--entry MODE" where the arguments begin with it. Returns the index of the first argument after
/// it, 1 without it, 0 after printing that MODE is unknown.
inline int first_after_entry(int count, char** arguments) {
  if (count < 3 || std::string_view(arguments[1]) != "--entry") return 1;
  if (set_floating_point_mode(arguments[2])) return 3;
  std::fprintf(stderr, "%s: --entry %s is not known here\n", arguments[0], arguments[2]);
  return 0;
}

}  // namespace substep
