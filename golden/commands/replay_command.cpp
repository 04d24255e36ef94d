#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "golden/check/replay.h"
#include "golden/commands/commands.h"
#include "golden/suite/approval_journal.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep {

void add_replay_command(CLI::App& app) {
  struct Options {
    std::string name;
    std::filesystem::path suite = "golden/suite.toml";
    ReplayOptions replay;
    std::optional<std::filesystem::path> player;
  };
  CLI::App* const command = app.add_subcommand(
      "replay", "Run a case of the suite again, and show what a body did beside its golden run");
  const auto options = std::make_shared<Options>();
  command->add_option("case", options->name, "The case: box_stack.a4")->required();
  command->add_option("--suite", options->suite, "The suite file, or its folder")->capture_default_str();
  command->add_option("--to", options->replay.to, "The last frame (the case's last)");
  command->add_option("--before", options->replay.before, "How many frames to show before it")
      ->capture_default_str();
  command->add_option("--focus", options->replay.focus, "The body to show (the one that differs most)");
  command->add_option("--player", options->player, "Also write a page, .html, that plays both runs");
  command->footer(
      "Example:\n  substep replay box_stack.a4 --to 52 --focus box_03\n"
      "  substep replay box_stack.a4 --player box_stack.html");
  command->callback([options] {
    const Suite suite = read_suite(options->suite);
    finish_approvals(suite.folder());
    const std::vector<SuiteCase> cases = select(suite, {options->name});
    if (options->player) {
      if (options->player->extension() != ".html") {
        throw Error(fmt::format("{}: give a name that ends in .html", options->player->string()));
      }
      require_folder_of(*options->player);
    }
    for (const SuiteCase& entry : cases) {
      fmt::print("{}\n", replay(entry, options->replay));
      if (!options->player) continue;
      write_file(*options->player, replay_page(entry, options->replay));
      fmt::print("wrote {}\n", options->player->string());
    }
  });
}

}  // namespace substep
