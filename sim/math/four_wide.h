#pragma once
/// Kernels on lanes are compiled twice, for SSE2 (two doubles, on every x86-64) and for AVX2 (four): the same
/// operations, so the same bits.

/// Marks a function that is inlined into kernels of both widths.
#define SUBSTEP_KERNEL [[gnu::always_inline]] inline

namespace substep {

/// Returns true where the processor has AVX2 according to glibc, whose tunables can hide it for a test.
bool is_four_wide();

template <typename Kernel>
auto run_two_wide(const Kernel& kernel) {
  return kernel();
}
template <typename Kernel>
[[gnu::target("avx2")]] auto run_four_wide(const Kernel& kernel) {
  return kernel();
}

/// Runs a kernel with vectors as wide as the processor has. It is inlined into both functions above, so it
/// and all that it calls have to be `always_inline`.
template <typename Kernel>
auto run_wide(const Kernel& kernel) {
  return is_four_wide() ? run_four_wide(kernel) : run_two_wide(kernel);
}

}  // namespace substep
