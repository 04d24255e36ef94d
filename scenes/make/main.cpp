/// make_scenes FOLDER: writes every scene of the library to FOLDER, the same bytes each time.

#include <fmt/format.h>
#include <exception>
#include <filesystem>

#include "scenes.h"
#include "sim/log/file_output.h"

int main(int argc, char** argv) {
  using namespace substep::scenes;
  if (argc != 2) {
    fmt::print(stderr,
               "make_scenes FOLDER: writes the scenes of the library to FOLDER, which must be there\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const auto write = [](const std::filesystem::path& to, const std::vector<SceneFunction>& scenes) {
    for (const SceneFunction make : scenes) {
      const GltfBuilder gltf = make();
      substep::write_file(to / (gltf.name() + ".gltf"), gltf.text());
    }
  };
  try {
    for (const auto& scenes :
         {stack_scenes(), impact_scenes(), joint_scenes(), mechanism_scenes(), friction_scenes(),
          slide_scenes(), rolling_scenes(), spin_scenes(), driven_scenes(), meeting_scenes()})
      write(folder, scenes);
    std::filesystem::create_directory(folder / "published");
    write(folder / "published", published_scenes());
  } catch (const std::exception& error) {
    fmt::print(stderr, "make_scenes: {}\n", error.what());
    return 2;
  }
  return 0;
}
