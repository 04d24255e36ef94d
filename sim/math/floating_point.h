#pragma once
/// The floating-point environment in which results have the same bits everywhere.

#include <cfenv>

namespace substep {

/// Makes this thread round to nearest, keep subnormal numbers and trap no exception, and restores the
/// caller's environment with its flags at the end. Used wherever a caller enters code whose results have the
/// same bits everywhere.
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
