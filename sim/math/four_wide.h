#pragma once
/// Kernels on lanes are compiled twice, for the vectors of every x86-64 and for wider ones: the same
/// operations, so the same bits.

namespace substep {

/// Whether the processor has the wider ones. As glibc sees it, so that its tunables can hide the instructions
/// from a test.
bool is_four_wide();

}  // namespace substep
