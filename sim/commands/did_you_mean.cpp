#include "sim/commands/did_you_mean.h"

#include <fmt/format.h>

#include <algorithm>

namespace substep {
namespace {

constexpr std::size_t most_letters = 2;

/// Returns the edit distance: the number of letters to insert, delete, replace or swap with the next one.
std::size_t letters_between(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> least(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        least[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = least[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      least[i][j] = std::min({replaced, least[i - 1][j] + 1, least[i][j - 1] + 1});
      const bool is_swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (is_swapped) least[i][j] = std::min(least[i][j], least[i - 2][j - 2] + 1);
    }
  }
  return least[a.size()][b.size()];
}

/// Returns the nearest of the names within most_letters, or "".
std::string nearest(const std::vector<std::string>& names, const std::string& typed) {
  const auto distance = [&](const std::string& name) { return letters_between(name, typed); };
  const auto found = std::ranges::min_element(names, {}, distance);
  return found == names.end() || distance(*found) > most_letters ? "" : *found;
}

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* const command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

}  // namespace

bool is_command(const CLI::App& app, const std::string& name) {
  const std::vector<std::string> names = commands_of(app);
  return std::ranges::find(names, name) != names.end();
}

std::string command_like(const CLI::App& app, const std::string& typed) {
  const std::string name = nearest(commands_of(app), typed);
  return name.empty() ? "" : fmt::format(": did you mean '{}'?", name);
}

std::string option_like(const CLI::App& command, const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const CLI::Option* const option : command.get_options()) {
    if (!option->get_lnames().empty()) names.push_back("--" + option->get_lnames().front());
  }
  for (const std::string& word : words) {
    const std::string typed = word.substr(0, word.find('='));
    if (!typed.starts_with("--") || std::ranges::find(names, typed) != names.end()) continue;
    const std::string name = nearest(names, typed);
    if (!name.empty()) return fmt::format("{}: did you mean {}?", typed, name);
  }
  return "";
}

}  // namespace substep
