#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "golden/commands/commands.h"
#include "golden/compare/provenance.h"
#include "golden/report/failures.h"
#include "golden/suite/suite.h"
#include "sim/error.h"
#include "sim/loading/json_value.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/scene/scene.h"
#include "sim/study/engines/engines.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

constexpr int most_frames = 240;  // keeps goldens small; faults show by then
constexpr int full_every = 10;

/// Returns the scene files below a folder, sorted, without those in folders that cannot be read.
std::vector<fs::path> scene_files(const fs::path& project) {
  std::vector<fs::path> files;
  std::error_code failure;
  fs::directory_iterator(project, failure);
  if (failure) throw Error("{}: cannot be read: {}", project.string(), failure.message());
  auto entry = fs::recursive_directory_iterator(project, fs::directory_options::skip_permission_denied);
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

/// Returns the scene's [[case]], whose frames are the scene's duration rounded down to a multiple of
/// `full_every`, from `full_every` to `most_frames`. Throws Error where the scene cannot be a case.
std::string case_of(const fs::path& file, const std::string& shown) {
  if (!is_case_name(file.stem().string())) throw Error("its name must be of letters, digits, _ and -");
  const Scene scene = load_scene(file);
  if (std::ranges::none_of(scene.bodies, [](const Body& body) { return body.inverse_mass > 0; }))
    throw Error("nothing in it moves");
  const double all = std::floor(scene.duration / scene.step / full_every) * full_every;
  const int frames = static_cast<int>(std::clamp<double>(all, full_every, most_frames));
  const int middle = std::max(full_every, frames / 2 / full_every * full_every);
  return fmt::format("[[case]]\nscene = {}\nframes = {}\nimages = [{}{}]\n", Json("../" + shown).dump(),
                     frames, middle == frames ? "" : fmt::format("{}, ", middle), frames);
}

constexpr const char* suite_start =
    R"(# Cases: each [[case]] is a scene and how it is run. `substep check` compares with the goldens beside this
# file, `substep approve` replaces them with the last check's results. golden/suite/suite.h of substep explains every key.

[defaults]
full_every = 10          # the pose log has the poses of every 10th frame; pictures are of such frames
size = [320, 180]        # of the pictures
{}
time_limit = 120         # s, for checking a case
# images = []            # in a case: poses alone, which need no renderer

# Without a tolerance poses are compared bit for bit. In a case whose poses may differ a little:
# pose_tolerance = {{ position = 1e-4, orientation = 1e-3, energy = 0.02, penetration = 1e-3, resting = 1 }}
)";

constexpr const char* own_run_line =
    R"(algorithms = ["a5"]      # any of a1 to a5: each is a case of its own)";

/// Splits a command line into words, in which "…" quotes.
Command words_of(const std::string& line) {
  Command words;
  std::istringstream stream(line);
  for (std::string word; stream >> std::quoted(word);) words.push_back(word);
  return words;
}

/// Returns the line of [defaults] that runs the command. Files of the project in it get "../", since it runs
/// in golden/.
std::string run_line_of(const std::string& command, const fs::path& project) {
  Json words = words_of(command);
  for (Json& word : words) {
    const fs::path file = word.get<std::string>();
    if (file.is_relative() && fs::is_regular_file(project / file)) word = "../" + file.generic_string();
  }
  return fmt::format("command = {}", words.dump());
}

constexpr const char* readme = R"(# Goldens

Approved results of the scenes of `suite.toml`.

    substep check                                   # compares; a new case has no golden yet
    substep approve --failed --reason "why"         # after you looked at out/check/report.html

When the check fails in CI, download its `report` and open `report.html` in it. If the change is intended, run the workflow
by hand on that branch, with the names of the cases and the reason; or approve here what you saw, with `--output report`.
)";

constexpr const char* workflow =
    R"(# The goldens, checked at every push; the report is an artifact of the run, whatever its outcome. A run started by hand
# approves cases and commits their goldens. A check may only read the repository, so that a fork's pull request gets no token
# that writes. Only the run by hand may write, and only people who may push can start it.
name: goldens
on:
  push:
  pull_request:
  workflow_dispatch:
    inputs:
      cases: {{ description: "names of cases, as in the report", required: true }}
      reason: {{ description: "why the new goldens are right", required: true }}
permissions: {{ contents: read }}
jobs:
  check:
    if: github.event_name != 'workflow_dispatch'
    uses: OWNER/substep/.github/workflows/suite.yml@main
    with: {{ suite: golden, program: OWNER/substep, version: v{1}, setup: "{0}" }}
  approve:
    if: github.event_name == 'workflow_dispatch'
    permissions: {{ contents: write }}
    uses: OWNER/substep/.github/workflows/suite.yml@main
    with: {{ suite: golden, program: OWNER/substep, version: v{1}, setup: "{0}", approve: "${{{{ inputs.cases }}}}", reason: "${{{{ inputs.reason }}}}" }}
)";

/// Returns the shell command that installs python3 or Node.js where a simulator's command starts it; "true":
/// another program, whose package is not known.
std::string setup_for(const std::string& command) {
  std::string program;
  std::istringstream(command) >> std::quoted(program);
  if (program != "python3" && program != "node") return "true";
  return "apt-get install -y -q --no-install-recommends " + (program == "node" ? "nodejs" : program);
}

struct InitOptions {
  fs::path project = ".";
  std::string command;  ///< of a simulator, in place of the algorithms
};

struct NewSuite {
  std::vector<std::pair<fs::path, std::string>> files;  ///< paths in the project, with their contents
  std::map<std::string, std::string> scenes;            ///< files of the scenes that are cases, by name
  std::vector<std::string> others;                      ///< scenes that cannot be cases, each with the reason
};

/// Returns a suite of the scenes (.gltf, .glb) in `project` and its folders, without hidden ones and
/// `build*`. A scene is a case where it can be loaded and something in it moves; `others` lists the rest.
/// Throws Error where the folder or every such scene is missing, or a simulator's command lacks {poses}.
NewSuite new_suite(const InitOptions& options) {
  const fs::path& project = options.project;
  if (!fs::is_directory(project)) throw Error("{}: there is no such folder", project.string());
  NewSuite suite;
  const bool is_own = options.command.empty();
  if (!is_own && options.command.find("{poses}") == std::string::npos)
    throw Error(
        "--command: {poses} is missing: write it where the simulator takes the name of its output table");
  std::string text =
      fmt::format(fmt::runtime(suite_start), is_own ? own_run_line : run_line_of(options.command, project));
  for (const fs::path& file : scene_files(project)) {
    const std::string shown = file.lexically_relative(project).generic_string();
    try {
      const std::string entry = case_of(file, shown);
      const auto [known, is_new] = suite.scenes.emplace(file.stem().string(), shown);
      if (!is_new) throw Error("{} already has this name", known->second);
      text += "\n" + entry;
    } catch (const Error& error) {
      suite.others.push_back(fmt::format("{}: {}", shown, error.what()));
      std::ranges::replace(suite.others.back(), '\n', ' ');
    }
  }
  if (suite.scenes.empty())
    throw Error("{}: has no scene (.gltf or .glb) in which something moves", project.string());
  for (const std::string& other : suite.others) text += fmt::format("\n# not taken: {}\n", other);
  suite.files = {{"golden/suite.toml", text},
                 {"golden/README.md", readme},
                 {"golden/.gitattributes", "*.poses -text\n"},  // a log with other line ends is damaged
                 {".github/workflows/goldens.yml",
                  fmt::format(fmt::runtime(workflow), setup_for(options.command), made_with(false).version)}};
  if (!fs::exists(project / ".gitignore")) suite.files.emplace_back(".gitignore", "/out/\n");
  return suite;
}

/// Writes the suite. Throws Error, and writes nothing, where one of its files is there already.
void init(const InitOptions& options) {
  const NewSuite suite = new_suite(options);
  for (const auto& [name, content] : suite.files) {
    const fs::path file = options.project / name;
    if (fs::exists(file)) throw Error("{}: is there already; nothing was written", file.string());
  }
  for (const auto& [name, content] : suite.files) {
    const fs::path file = options.project / name;
    fs::create_directories(file.parent_path());
    write_file(file, content);
    fmt::print("wrote {}\n", file.string());
  }
  fmt::print("scenes that are cases: {}", suite.scenes.size());
  if (!suite.others.empty()) fmt::print("; that are not: {}, the suite file says why", suite.others.size());
  fmt::print("\nnext:\n");
  if (options.project != ".") fmt::print("  cd {}\n", shell_word(options.project.string()));
  fmt::print("  substep check\n  substep approve --failed --reason \"the first goldens\"\n");
  if (suite.files.back().first != ".gitignore") fmt::print("  echo /out/ >> .gitignore\n");
  std::set<std::string> own;  // the folders, or files, that have the scenes
  for (const auto& [name, scene] : suite.scenes) own.insert(shell_word(fs::path(scene).begin()->string()));
  fmt::print("  git add golden .github/workflows/goldens.yml .gitignore {}\n", fmt::join(own, " "));
  if (!fs::exists(options.project / ".git"))
    fmt::print(
        "where the repository's root is another folder, move .github to it: GitHub looks only there\n");
  fmt::print("and in .github/workflows/goldens.yml replace OWNER by the owner of the substep repository\n");
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
