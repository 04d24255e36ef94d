#pragma once
/// The floating-point environment that the same bits are promised in.

#include <cfenv>

namespace substep {

/// While it lives, this thread rounds to nearest, keeps subnormal numbers and traps no exception, however its
/// caller has set the processor; then everything is as it was, the exceptions' flags included. Stands
/// wherever a caller enters code whose results are promised to the last bit.
class DefaultFloatingPoint {
 public:
  DefaultFloatingPoint();
  ~DefaultFloatingPoint();
  DefaultFloatingPoint(const DefaultFloatingPoint&) = delete;
  DefaultFloatingPoint& operator=(const DefaultFloatingPoint&) = delete;

 private:
#if defined(__x86_64__)
  unsigned int vector_control_;   // SSE's, with which everything is computed
  unsigned short stack_control_;  // x87's, which the C library asks how to round decimals
#else
  std::fenv_t environment_;
#endif
};

}  // namespace substep
