#include "golden/report/case_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Returns a path as a word that is no option, whatever its name.
std::string path_word(const fs::path& path) {
  const std::string text = path.string();
  return shell_word(text.starts_with('-') ? fmt::format("./{}", text) : text);
}

std::string suite_option(const ResultsLocation& location) {
  if (location.suite == fs::path("golden/suite.toml")) return {};
  return fmt::format(" --suite {}", path_word(location.suite));
}

}  // namespace

std::string shell_word(const std::string& word) {
  const bool is_plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
  });
  if (is_plain) return word;
  std::string result(1, '\'');
  for (const char c : word) {
    if (c == '\'') result += "'\\'";
    result += c;
  }
  result += '\'';
  return result;
}

ResultsLocation location_of(const Json& results, const fs::path& output) {
  std::error_code none;
  const fs::path here = fs::current_path(none);
  const auto near = [&](const fs::path& path) {
    if (!path.is_absolute() || here.empty()) return path;
    const fs::path relative = path.lexically_relative(here);
    return relative.empty() || *relative.begin() == ".." ? path : relative;
  };
  return {near(results.at("suite").get<std::string>()), near(output)};
}

std::string approve_command(const Json& entry, const ResultsLocation& location) {
  const bool can_approve = entry.at("refusal").get<std::string>().empty() && entry.contains("candidates");
  if (!can_approve) return {};
  std::string command = "substep approve " + shell_word(entry.at("name").get<std::string>());
  command += suite_option(location);
  if (location.output != fs::path("out/check"))
    command += fmt::format(" --output {}", path_word(location.output));
  return command + " --reason \"...\"";
}

std::string explanation(const Json& entry, const ResultsLocation& location) {
  const std::string command = approve_command(entry, location);
  return entry.at("text").get<std::string>() +
         fmt::format("  files    {}\n", (location.output / entry.at("files").get<std::string>()).string()) +
         fmt::format("  approve  {}\n", command.empty() ? fmt::format("not from this check: {}",
                                                                      entry.at("refusal").get<std::string>())
                                                        : command);
}

}  // namespace substep::golden
