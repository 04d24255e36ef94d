#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "golden/commands/commands.h"
#include "golden/report/case_commands.h"
#include "golden/suite/suite.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/scene/scene.h"
#include "sim/study/engines/command_engine.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

constexpr int longest = 240;  // frames: goldens stay small, and what goes wrong shows by then
constexpr int full_every = 10;

/// Scene files below a folder, sorted.
std::vector<fs::path> scene_files(const fs::path& project) {
  std::vector<fs::path> files;
  std::error_code failure;
  auto entry = fs::recursive_directory_iterator(project, failure);
  if (failure) throw Error(fmt::format("{}: cannot be read: {}", project.string(), failure.message()));
  for (; entry != fs::recursive_directory_iterator(); ++entry) {
    const std::string name = entry->path().filename().string();
    if (entry->is_directory() && (name.starts_with('.') || name.starts_with("build"))) {
      entry.disable_recursion_pending();
    }
    const fs::path extension = entry->path().extension();
    if (entry->is_regular_file() && (extension == ".gltf" || extension == ".glb"))
      files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Returns how many frames make a case: the whole duration in tens, at most `longest`.
int frames_of(const Scene& scene) {
  const double all = std::floor(scene.duration / scene.step / full_every) * full_every;
  return static_cast<int>(std::clamp<double>(all, full_every, longest));
}

/// Its [[case]], or why it cannot be one.
std::optional<std::string> case_of(const fs::path& file, const std::string& shown, std::string& why) {
  if (!is_case_name(file.stem().string())) {
    why = "its name must be of letters, digits, _ and -";
    return {};
  }
  try {
    const Scene scene = load_scene(file);
    const bool moves = std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                   [](const Body& body) { return body.inverse_mass > 0; });
    if (!moves) {
      why = "nothing in it moves";
      return {};
    }
    const int frames = frames_of(scene);
    const int middle = std::max(full_every, frames / 2 / full_every * full_every);
    return fmt::format("[[case]]\nscene = \"../{}\"\nframes = {}\nimages = [{}]\n", shown, frames,
                       middle == frames ? fmt::format("{}", frames) : fmt::format("{}, {}", middle, frames));
  } catch (const Error& error) {
    why = error.what();
    return {};
  }
}

constexpr const char* suite_start =
    R"(# What is watched: each [[case]] is a scene with a run. `substep check` compares with the goldens beside this file,
# `substep approve` makes them what they are. golden/suite/suite.h of substep explains every key.

[defaults]
full_every = 10          # the pose log has the poses of every 10th frame; pictures are of such frames
size = [320, 180]        # of the pictures
{}
time_limit = 120         # s, for checking a case
# images = []            # in a case: poses alone, which need no renderer

# Without a tolerance poses are compared bit for bit. In a case whose poses may differ a little:
# pose_tolerance = {{ position = 1e-4, orientation = 1e-3, energy = 0.02, penetration = 1e-3, resting = 1 }}
)";

constexpr const char* own_origin = R"(algorithms = ["a5"]      # any of a1 to a5: each is a case of its own)";

/// Returns the words of a command line, in which "…" quotes.
Command words_of(const std::string& line) {
  Command words;
  std::istringstream stream(line);
  for (std::string word; stream >> std::quoted(word);) words.push_back(word);
  return words;
}

/// Returns the line of [defaults] that runs the command: its files are in the project, the suite in golden.
std::string origin_of(const std::string& command, const fs::path& project) {
  nlohmann::json words = words_of(command);
  for (nlohmann::json& word : words) {
    const fs::path file = word.get<std::string>();
    if (file.is_relative() && fs::is_regular_file(project / file)) word = "../" + file.generic_string();
  }
  return fmt::format("command = {}", words.dump());
}

constexpr const char* readme = R"(# Goldens

What the scenes of `suite.toml` did when somebody last looked and found it good.

    substep check                                   # compares; a new case has no golden yet
    substep approve --failed --reason "why"         # after you looked at out/check/report.html

When the check fails in CI, download its `report` and open `report.html` in it. Where the change is meant, run the workflow by
hand on that branch, with the names of the cases and the reason; or approve here what you saw, with `--output report`.
)";

constexpr const char* workflow =
    R"(# The goldens, checked at every push; the report is an artifact of the run, whatever its outcome. A run by hand approves
# cases and commits them. A check may only read the repository, so that a fork's pull request gets no token that writes. Only
# the run by hand may write, and only who may push can start it.
name: goldens
on:
  push:
  pull_request:
  workflow_dispatch:
    inputs:
      cases: {{ description: "names of cases, as in the report", required: true }}
      reason: {{ description: "why they are right now", required: true }}
permissions: {{ contents: read }}
jobs:
  check:
    if: github.event_name != 'workflow_dispatch'
    uses: OWNER/substep/.github/workflows/suite.yml@main
    with: {{ suite: golden, program: OWNER/substep, setup: "{0}" }}
  approve:
    if: github.event_name == 'workflow_dispatch'
    permissions: {{ contents: write }}
    uses: OWNER/substep/.github/workflows/suite.yml@main
    with: {{ suite: golden, program: OWNER/substep, setup: "{0}", approve: "${{{{ inputs.cases }}}}", reason: "${{{{ inputs.reason }}}}" }}
)";

/// Returns the shell command that installs the program that a simulator's command starts; "true": none.
std::string setup_for(const std::string& command) {
  const Command words = words_of(command);
  if (words.empty() || words.front().find('/') != std::string::npos) return "true";
  return "apt-get install -y -q --no-install-recommends " +
         (words.front() == "node" ? "nodejs" : words.front());
}

struct InitOptions {
  fs::path project = ".";
  std::string command;  ///< of a simulator, in place of the algorithms
};

struct NewSuite {
  struct File {
    fs::path name;  ///< below the project's folder
    std::string content;
  };
  std::vector<File> files;          ///< suite file, README of the goldens, workflow
  std::size_t scenes = 0;           ///< how many scenes are cases
  std::vector<std::string> others;  ///< scenes that cannot be cases, each with the reason
};

/// Returns a suite of the scenes (.gltf, .glb) in `project` and its folders, without hidden ones and
/// `build*`. A scene is a case where it can be loaded and something in it moves. Throws Error where there is
/// no such folder or no such scene.
NewSuite new_suite(const InitOptions& options) {
  const fs::path& project = options.project;
  if (!fs::is_directory(project)) throw Error(fmt::format("{}: there is no such folder", project.string()));
  NewSuite suite;
  const bool is_own = options.command.empty();
  if (!is_own && options.command.find("{poses}") == std::string::npos)
    throw Error("--command: {poses} must stand for the table that the simulator writes");
  std::string text =
      fmt::format(fmt::runtime(suite_start), is_own ? own_origin : origin_of(options.command, project));
  std::map<std::string, std::string> names;
  for (const fs::path& file : scene_files(project)) {
    const std::string shown = file.lexically_relative(project).generic_string();
    std::string why;
    const std::optional<std::string> entry = case_of(file, shown, why);
    if (!entry) {
      std::replace(why.begin(), why.end(), '\n', ' ');
      suite.others.push_back(fmt::format("{}: {}", shown, why));
      continue;
    }
    const auto [known, is_new] = names.emplace(file.stem().string(), shown);
    if (!is_new) {
      suite.others.push_back(fmt::format("{}: {} has its name", shown, known->second));
      continue;
    }
    ++suite.scenes;
    text += "\n" + *entry;
  }
  if (suite.scenes == 0) {
    throw Error(fmt::format("{}: has no scene (.gltf or .glb) in which something moves", project.string()));
  }
  for (const std::string& other : suite.others) text += fmt::format("\n# not taken: {}\n", other);
  suite.files = {
      {"golden/suite.toml", text},
      {"golden/README.md", readme},
      {".github/workflows/goldens.yml", fmt::format(fmt::runtime(workflow), setup_for(options.command))}};
  if (!fs::exists(project / ".gitignore")) suite.files.push_back({".gitignore", "/out/\n"});
  return suite;
}

/// Throws Error, and writes nothing, where one of the files is there already.
void write_new_suite(const NewSuite& suite, const fs::path& project) {
  for (const NewSuite::File& file : suite.files) {
    if (fs::exists(project / file.name)) {
      throw Error(fmt::format("{}: is there already; nothing was written", (project / file.name).string()));
    }
  }
  for (const NewSuite::File& file : suite.files) {
    fs::create_directories((project / file.name).parent_path());
    write_file(project / file.name, file.content);
  }
}

void init(const InitOptions& options) {
  const NewSuite suite = new_suite(options);
  const bool ignores_out = suite.files.back().name == ".gitignore";
  write_new_suite(suite, options.project);
  for (const NewSuite::File& file : suite.files)
    fmt::print("wrote {}\n", (options.project / file.name).string());
  fmt::print("{} scenes are cases", suite.scenes);
  if (!suite.others.empty()) fmt::print(", {} are not: the suite file says why", suite.others.size());
  fmt::print("\nnext:\n");
  if (options.project != ".") fmt::print("  cd {}\n", shell_word(options.project.string()));
  fmt::print("  substep check\n  substep approve --failed --reason \"the first goldens\"\n");
  if (!ignores_out) fmt::print("  echo /out/ >> .gitignore\n");
  fmt::print("  git add golden .github/workflows/goldens.yml .gitignore\n");
  fmt::print("and in .github/workflows/goldens.yml put the owner of the repository with substep for OWNER\n");
}

}  // namespace

void add_init_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("init", "Write a suite of goldens, a workflow and a README for a project's scenes");
  const auto options = std::make_shared<InitOptions>();
  command->add_option("folder", options->project, "The project's folder: its scenes are looked for in it")
      ->capture_default_str();
  command->add_option("--command", options->command,
                      "A simulator that makes the runs: its command line with {scene}, {settings}, {poses}");
  command->footer(
      "Overwrites nothing.\nExample:\n  substep init . --command \"python3 mine.py {scene} {settings} "
      "{poses}\"");
  command->callback([options] { init(*options); });
}

}  // namespace substep::golden
