#pragma once
/// The floating-point environment in which results have the same bits everywhere.

namespace substep {

/// Makes this thread round to nearest, keep subnormal numbers and trap no exception, and restores the
/// caller's environment with its flags at the end. Functions of the interface whose results have the same
/// bits everywhere begin with one.
class DefaultFloatingPoint {
 public:
  DefaultFloatingPoint();
  ~DefaultFloatingPoint();
  DefaultFloatingPoint(const DefaultFloatingPoint&) = delete;
  DefaultFloatingPoint& operator=(const DefaultFloatingPoint&) = delete;

 private:
  unsigned int vector_control_;   // of SSE, which does all our arithmetic
  unsigned short stack_control_;  // of x87, from which the C library takes the rounding of decimals
};

}  // namespace substep
