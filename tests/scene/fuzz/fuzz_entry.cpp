/// libFuzzer's entry to the target. With clang: cmake --preset fuzz, then
/// build-fuzz/tests/scene/fuzz/scene_fuzzer with -dict=tests/scene/fuzz/gltf.dict, a folder for what it
/// finds, and tests/scene/fuzz/corpus.

#include <cstddef>
#include <cstdint>

#include "tests/scene/fuzz/scene_fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  substep::loads_or_is_refused({reinterpret_cast<const char*>(data), size});
  return 0;
}
