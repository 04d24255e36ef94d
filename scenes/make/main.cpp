/// make_scenes FOLDER: writes every scene of the library to FOLDER, the same bytes each time.

#include <fmt/format.h>
#include <filesystem>

#include "scenes.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr,
               "make_scenes FOLDER: writes the scenes of the library to FOLDER, which must be there\n");
    return 2;
  }
  try {
    for (const substep::make::SceneFile& scene : substep::make::all_scenes)
      substep::write_file(std::filesystem::path(argv[1]) / fmt::format("{}.gltf", scene.name), scene.text());
  } catch (const substep::Error& error) {
    fmt::print(stderr, "make_scenes: {}\n", error.what());
    return 2;
  }
  return 0;
}
