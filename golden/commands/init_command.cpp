#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "golden/commands/commands.h"
#include "golden/report/case_commands.h"
#include "golden/suite/new_suite.h"

namespace substep::golden {
namespace {

struct InitOptions {
  std::filesystem::path project = ".";
  std::string program = "OWNER/substep";
};

void init(const InitOptions& options) {
  const NewSuite suite = new_suite(options.project, options.program);
  write_new_suite(suite, options.project);
  for (const NewSuite::File& file : suite.files)
    fmt::print("wrote {}\n", (options.project / file.name).string());
  fmt::print("{} scenes are cases", suite.scenes.size());
  if (!suite.others.empty()) fmt::print(", {} are not: the suite file says why", suite.others.size());
  fmt::print("\nnext:\n");
  if (options.project != ".") fmt::print("  cd {}\n", shell_word(options.project.string()));
  fmt::print("  substep check\n  substep approve --failed --reason \"the first goldens\"\n");
  fmt::print("  git add golden {}\n", shell_word(suite.files.back().name.string()));
  if (options.program == InitOptions().program) {
    fmt::print("and in {} put the owner of the repository with substep for OWNER\n",
               suite.files.back().name.string());
  }
}

}  // namespace

void add_init_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("init", "Write a suite of goldens, a workflow and a README for a project's scenes");
  const auto options = std::make_shared<InitOptions>();
  command->add_option("folder", options->project, "The project's folder: its scenes are looked for in it")
      ->capture_default_str();
  command->add_option("--program", options->program, "The repository with substep, whose workflow is used")
      ->capture_default_str();
  command->footer("Overwrites nothing.\nExample:\n  substep init .");
  command->callback([options] { init(*options); });
}

}  // namespace substep::golden
