#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <string_view>

#include "golden/suite/suite.h"
#include "sim/error.h"

namespace substep::golden {

namespace fs = std::filesystem;

std::vector<SuiteCase> select(const Suite& suite, const std::vector<std::string>& names) {
  if (names.empty()) return suite.cases;
  std::vector<SuiteCase> chosen;
  std::set<std::string> matched;
  for (const SuiteCase& entry : suite.cases) {
    const std::string scene_name = entry.scene.stem().string();
    bool wanted = false;
    for (const std::string& name : names) {
      if (name != entry.name && name != scene_name) continue;
      matched.insert(name);
      wanted = true;
    }
    if (wanted) chosen.push_back(entry);
  }
  for (const std::string& name : names) {
    if (matched.count(name) != 0) continue;
    std::vector<std::string_view> known;
    for (const SuiteCase& entry : suite.cases) known.push_back(entry.name);
    throw Error(
        fmt::format("{}: has no case '{}'; cases are {}", suite.file.string(), name, fmt::join(known, " ")));
  }
  return chosen;
}

std::vector<fs::path> orphans(const Suite& suite) {
  std::set<fs::path> claimed;
  for (const SuiteCase& entry : suite.cases) {
    claimed.insert(entry.pose_file.lexically_normal());
    claimed.insert(entry.track_file.lexically_normal());
    claimed.insert(entry.sidecar.lexically_normal());
    for (const int frame : entry.images) claimed.insert(entry.image_file(frame).lexically_normal());
  }
  std::vector<fs::path> result;
  for (const char* folder : {"poses", "images"}) {
    std::error_code none;
    for (const auto& entry : fs::recursive_directory_iterator(suite.folder() / folder, none)) {
      // .DS_Store, Thumbs.db and the like come by themselves.
      const std::string name = entry.path().filename().string();
      if (entry.is_directory() || name.starts_with('.') || name == "Thumbs.db" || name == "desktop.ini")
        continue;
      if (claimed.count(entry.path().lexically_normal()) == 0) result.push_back(entry.path());
    }
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace substep::golden
