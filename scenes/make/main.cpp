/// make_scenes FOLDER: writes every scene of the library to FOLDER, and those that are sampled to
/// FOLDER/sampled and FOLDER/held_out, the same bytes each time.

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
    for (const substep::make::SceneFile& scene : substep::make::all_scenes)
      substep::write_file(folder / fmt::format("{}.gltf", scene.name), scene.text());
    for (const substep::make::SampledFamily& family : substep::make::sampled_families) {
      for (int number = 1; number <= family.sampled + family.held_out; ++number) {
        const char* const part = number <= family.sampled ? "sampled" : "held_out";
        const std::filesystem::path own = folder / part / family.folder;
        std::filesystem::create_directories(own);
        substep::write_file(own / fmt::format("{}_{}.gltf", family.name, number), family.text(number));
      }
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "make_scenes: {}\n", error.what());
    return 2;
  }
  return 0;
}
