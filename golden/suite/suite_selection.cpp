#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <string_view>

#include "golden/suite/suite.h"
#include "sim/error.h"

namespace substep {

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

std::vector<SuiteCase> part_of(const std::vector<SuiteCase>& cases, Shard shard) {
  std::vector<SuiteCase> part;
  std::vector<std::string> scenes;
  for (const SuiteCase& entry : cases) {
    const std::string scene = entry.scene.stem().string();
    auto found = std::find(scenes.begin(), scenes.end(), scene);
    if (found == scenes.end()) found = scenes.insert(scenes.end(), scene);
    if ((found - scenes.begin()) % shard.of == shard.number - 1) part.push_back(entry);
  }
  return part;
}

Shard shard_in(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto number = std::from_chars(text.data(), end, shard.number);
  const bool has_slash = number.ec == std::errc{} && number.ptr != end && *number.ptr == '/';
  const auto of = has_slash ? std::from_chars(number.ptr + 1, end, shard.of) : number;
  if (!has_slash || of.ec != std::errc{} || of.ptr != end || shard.number < 1 || shard.number > shard.of) {
    throw Error(fmt::format("--shard '{}': give a part and how many there are, such as 2/4", text));
  }
  return shard;
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

}  // namespace substep
