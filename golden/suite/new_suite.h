#pragma once
/// A suite for a project that has none yet: what `substep init` writes.

#include <filesystem>
#include <string>
#include <vector>

namespace substep::golden {

struct NewSuite {
  struct File {
    std::filesystem::path name;  ///< below the project's folder
    std::string content;
  };
  std::vector<File> files;          ///< suite file, README of the goldens, workflow
  std::vector<std::string> scenes;  ///< taken, below the project's folder
  std::vector<std::string> others;  ///< scenes that cannot be cases, each with why
};

/// Looks for scenes (.gltf, .glb) in `project` and the folders in it, hidden ones and `build*` but for. A
/// scene is taken when it can be loaded and something in it moves. `program` is the repository with substep
/// and its workflow: "OWNER/substep". Throws Error when
/// there is no such folder, no scene in it, or two of one name.
NewSuite new_suite(const std::filesystem::path& project, const std::string& program);

/// Throws Error, and writes nothing, when one of the files is there already.
void write_new_suite(const NewSuite& suite, const std::filesystem::path& project);

}  // namespace substep::golden
