#include "tests/folders.h"

namespace substep::test {

const char* const source_folder = SUBSTEP_SOURCE_DIR;
const char* const build_folder = SUBSTEP_BINARY_DIR;

}  // namespace substep::test
