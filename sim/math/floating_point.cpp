#include "sim/math/floating_point.h"

#include <fpu_control.h>
#include <xmmintrin.h>

namespace substep {

// Only the two control registers are saved: the functions of <cfenv> save all of x87's state, which takes as
// long as a step of the smallest scene.
DefaultFloatingPoint::DefaultFloatingPoint() : vector_control_(_mm_getcsr()), stack_control_(0) {
  constexpr unsigned int round_to_nearest_all_masked = 0x1f80;
  constexpr unsigned short as_the_c_library_starts = _FPU_DEFAULT;
  _FPU_GETCW(stack_control_);
  _FPU_SETCW(as_the_c_library_starts);
  _mm_setcsr(round_to_nearest_all_masked);
}

DefaultFloatingPoint::~DefaultFloatingPoint() {
  // Exceptions raised in between must not trap now.
  constexpr unsigned short all_masked = 0x3f;
  if ((stack_control_ & all_masked) != all_masked) asm volatile("fnclex");
  _FPU_SETCW(stack_control_);
  _mm_setcsr(vector_control_);
}

}  // namespace substep
