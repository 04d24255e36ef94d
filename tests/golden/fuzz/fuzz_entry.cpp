/// libFuzzer's entry to the target. With clang: cmake --preset fuzz, then
/// build-fuzz/tests/golden/fuzz/golden_fuzzer with a folder for what it finds and tests/golden/fuzz/corpus.

#include <cstddef>
#include <cstdint>

#include "tests/golden/fuzz/golden_fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  substep::golden::reads_or_refuses({reinterpret_cast<const char*>(data), size});
  return 0;
}
