#include "sim/study/engines/engines.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <system_error>
#include <thread>

#include "sim/error.h"
#include "sim/execution/child_process.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_table.h"
#include "sim/measure/json.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

void replace(std::string& text, std::string_view from, const std::string& to) {
  for (std::size_t i = text.find(from); i != std::string::npos; i = text.find(from, i + to.size())) {
    text.replace(i, from.size(), to);
  }
}

/// Returns the last line that is not blank, at most 300 bytes of it.
std::string last_line(std::string text) {
  const std::size_t end = text.find_last_not_of(" \n\r\t");
  if (end == std::string::npos) return "";
  text.resize(end + 1);
  return text.substr(text.rfind('\n') + 1).substr(0, 300);
}

/// Runs a program. Throws Error where it cannot start, fails or lasts longer than `time_limit` seconds.
void run_program(const Command& words, double time_limit) {
  const TemporaryFile messages;
  std::optional<ChildProcess> process;
  try {
    process.emplace(
        words, ChildProcess::Streams{ChildProcess::nowhere, ChildProcess::nowhere, messages.descriptor()});
  } catch (const std::system_error& error) {
    throw Error("{} cannot be started: {}", words.front(), error.code().message());
  }
  const auto start = std::chrono::steady_clock::now();
  std::optional<bool> succeeded;
  while (!(succeeded = process->ended())) {
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > time_limit)
      throw Error("{} has not ended after {:g} s", words.front(), time_limit);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (*succeeded) return;
  const std::string line = last_line(messages.content());
  const int code = process->exit_code();
  // Code 3: the simulator refuses the scene, and its line is the whole message.
  if (code == 3 && !line.empty()) throw Error(line);
  throw Error("{} ended with {} {}{}{}", words.front(), code < 0 ? "signal" : "exit code", std::abs(code),
              line.empty() ? "" : ": ", line);
}

}  // namespace

Command with_files_in(Command command, const fs::path& folder) {
  std::error_code ignored;
  for (std::string& word : command) {
    if (!word.empty() && fs::is_regular_file(folder / word, ignored)) word = (folder / word).string();
  }
  return command;
}

Engine command_engine(const Command& command) {
  std::error_code ignored;
  // Count a path that may be missing, such as one of a program to build, so that the label never changes.
  const auto is_file = [&](const std::string& word) {
    const bool is_path = word.find('/') != std::string::npos && word.find('{') == std::string::npos;
    const bool has_form =
        &word == &command.front() || (!word.starts_with('-') && fs::path(word).has_extension());
    return (is_path && has_form) || fs::is_regular_file(word, ignored);
  };
  const auto script = std::ranges::find_if(command, is_file);
  const std::string label = fs::path(script == command.end() ? command.front() : *script).stem().string();
  const MakeStepper make = [command](const Scene& scene, const Settings& settings) {
    return recorded_stepper(run_command(command, scene, settings));
  };
  return {"command", label, "a command", false, make, true, true};
}

std::vector<State> run_command(const Command& command, const Scene& scene, const Settings& settings,
                               double time_limit) {
  const PartialFile folder(fs::temp_directory_path() / "substep-run", PartialFile::Kind::folder);
  const fs::path scene_file = folder.path() / "scene.json";
  const fs::path settings_file = folder.path() / "settings.json";
  const fs::path poses = folder.path() / "poses.csv";
  Command words = command;
  bool has_poses = false;
  for (std::string& word : words) {
    has_poses = has_poses || word.find("{poses}") != std::string::npos;
    replace(word, "{scene}", scene_file.string());
    replace(word, "{settings}", settings_file.string());
    replace(word, "{poses}", poses.string());
  }
  if (!has_poses) {
    throw Error("command '{}': {{poses}} must stand for the table that it writes", fmt::join(command, " "));
  }
  // Replace invalid UTF-8, since names come from files in any encoding.
  constexpr auto replaced = Json::error_handler_t::replace;
  write_file(scene_file, scene_json(scene).dump(1, ' ', false, replaced));
  write_file(settings_file, Json{{"step", settings.step},
                                 {"duration", scene.duration},
                                 {"iterations", settings.iterations},
                                 {"substeps", settings.substeps}}
                                .dump());
  run_program(words, time_limit);
  std::error_code ignored;
  if (!fs::is_regular_file(poses, ignored)) throw Error("{} wrote no poses", words.front());
  try {
    return read_pose_table(poses, scene, settings.step);
  } catch (const Error& error) {
    // The folder is removed.
    std::string message = error.what();
    replace(message, folder.path().string() + "/", fmt::format("{}: ", words.front()));
    throw Error(message);
  }
}

}  // namespace substep
