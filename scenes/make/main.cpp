/// make_scenes FOLDER: writes every scene of the library to FOLDER, the same bytes each time.

#include <fmt/format.h>
#include <exception>
#include <filesystem>

#include "scenes.h"
#include "sim/log/file_output.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr,
               "make_scenes FOLDER: writes the scenes of the library to FOLDER, which must be there\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  try {
    std::filesystem::create_directory(folder / "published");
    for (const substep::scenes::SceneFile& scene : substep::scenes::all_scenes)
      substep::write_file(folder / fmt::format("{}.gltf", scene.name), scene.text());
  } catch (const std::exception& error) {
    fmt::print(stderr, "make_scenes: {}\n", error.what());
    return 2;
  }
  return 0;
}
