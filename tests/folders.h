#pragma once
/// Where the repository and the build are: in one object file, so that all others are the same bytes in every
/// clone.

namespace substep::test {

extern const char* const source_folder;
extern const char* const build_folder;

}  // namespace substep::test
