#include "sim/math/four_wide.h"

#ifdef __clang__
#define _Bool bool  // NOLINT: the next header is meant for C, and gcc's C++ knows this word of it
#endif
#include <sys/platform/x86.h>
#undef _Bool

namespace substep {

bool is_four_wide() {
  static const bool answer = CPU_FEATURE_ACTIVE(AVX2);
  return answer;
}

}  // namespace substep
