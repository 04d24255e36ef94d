#include "golden/report/case_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A path as a word that is no option, whatever its name.
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

ApproveCommand approve_command(const std::vector<std::string>& cases, const ResultsLocation& location) {
  ApproveCommand command{"substep approve", {}, " --reason \"...\""};
  for (const std::string& name : cases) command.before += fmt::format(" {}", shell_word(name));
  if (cases.empty()) command.before += " --failed";
  command.before += suite_option(location);
  if (location.output != fs::path("out/check")) {
    command.output = fmt::format(" --output {}", path_word(location.output));
  }
  return command;
}

CaseCommands commands_of(const Json& entry, const ResultsLocation& location) {
  const auto case_name = entry.at("name").get<std::string>();
  CaseCommands commands;
  commands.files = (location.output / entry.at("files").get<std::string>()).string();
  const bool can_approve = entry.at("refusal").get<std::string>().empty() && entry.contains("candidates");
  if (can_approve) commands.approve = approve_command({case_name}, location);
  return commands;
}

std::string explanation(const Json& entry, const ResultsLocation& location) {
  const CaseCommands commands = commands_of(entry, location);
  std::string text = entry.at("text");
  text += fmt::format("  files    {}\n", commands.files);
  if (commands.approve.is_there()) return text + fmt::format("  approve  {}\n", commands.approve.text());
  return text + fmt::format("  approve  not from this check: {}\n", entry.at("refusal").get<std::string>());
}

}  // namespace substep::golden
