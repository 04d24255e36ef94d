#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class CommandLine : public Program {
 protected:
  static std::string scene_text(const std::string& name) {
    std::ifstream stream(scene(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  /// The scene's text with the first `from` after `after` replaced.
  static std::string changed(std::string text, const std::string& after, const std::string& from,
                             const std::string& to) {
    const std::size_t start = text.find(after);
    EXPECT_NE(start, std::string::npos) << after;
    const std::size_t at = text.find(from, start);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
};

/// The names under "Subcommands:", in the order of the help.
std::vector<std::string> commands_in(const std::string& help) {
  std::vector<std::string> commands;
  std::istringstream lines(help.substr(std::min(help.size(), help.find("Subcommands:\n"))));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) {
    const std::size_t end = line.find(' ', 2);
    if (end > 2) commands.push_back(line.substr(2, end - 2));
  }
  return commands;
}

TEST_F(CommandLine, HelpOfEachCommandHasAnExample) {
  const Outcome all = run({"--help"});
  EXPECT_EQ(all.exit_code, 0);
  const std::vector<std::string> commands = commands_in(all.out);
  EXPECT_THAT(commands, testing::UnorderedElementsAre("run", "render", "video", "player", "export", "info",
                                                      "diff", "check", "approve", "init", "measure", "sweep",
                                                      "mlcp", "report"));
  for (const std::string& command : commands) {
    const Outcome one = run({command, "--help"});
    EXPECT_EQ(one.exit_code, 0);
    EXPECT_THAT(one.out, HasSubstr("Example:\n  substep " + command + " "));
    EXPECT_EQ(one.err, "");
  }
}

TEST_F(CommandLine, WhatCannotBeUnderstoodIsRefused) {
  const std::string chain = scene("rod_chain.gltf");
  expect_refused({}, "a command is needed");
  expect_refused({"walk"}, "walk");
  expect_refused({"rendr"}, "'rendr' is no command: did you mean 'render'?");
  expect_refused({"help", "rendr"}, "did you mean 'render'?");
  expect_refused({"run", chain, "--subteps", "4"}, "--subteps: did you mean --substeps?");
  expect_refused({"run", chain, "--setp", "1/60"}, "--setp: did you mean --step?");
  expect_refused({"run"}, "scene");
  expect_refused({"run", chain, "--speed", "3"}, "--speed");
  expect_refused({"run", chain, "--algorithm", "a6"},
                 "--algorithm 'a6': give a1, a2, a3, a4, a5, soft or avbd");
  expect_refused({"run", chain, "--set", "joints=loose"}, "--set 'joints=loose': give rows, plain or stable");
  expect_refused({"run", chain, "--step", "1/0"}, "--step '1/0'");
  expect_refused({"run", chain, "--step", "soon"}, "--step 'soon'");
  expect_refused({"run", chain, "--step", "0"}, "step 0");
  expect_refused({"run", chain, "--step", "-1/60"}, "step");
  expect_refused({"run", chain, "--step", "nan"}, "--step 'nan'");
  expect_refused({"run", chain, "--substeps", "0"}, "substeps 0");
  expect_refused({"run", chain, "--substeps", "many"}, "--substeps");
  expect_refused({"run", chain, "--substeps", "99999999999999"}, "--substeps");
  expect_refused({"run", chain, "--set", "tau=nan"}, "tau");
  expect_refused({"run", chain, "--set", "kappa=0"}, "kappa 0");
  expect_refused({"run", chain, "--set", "tau"}, "--set 'tau': give KEY=VALUE");
  expect_refused({"run", chain, "--set", "mass=3"}, "--set 'mass': give some of step, substeps");
  expect_refused({"run", chain, "--duration", "-1"}, "--duration '-1'");
  expect_refused({"run", chain, "--duration", "1e300"}, "too many");
  expect_refused({"run", chain, "--every", "0"}, "every 0 frames");
  expect_refused({"run", chain, "--output", "missing/a.poses.txt"}, "there is no folder missing");
  expect_refused({"run", chain, "--csv", "missing/a.csv"}, "there is no folder missing");
  expect_refused({"measure", chain, "--reference", "missing/a.csv"}, "there is no folder missing");
  expect_refused({"measure", chain, "--reference", "a.csv", "--duration", "0"},
                 "duration 0 s: from the scene's step");
  expect_refused({"measure", chain, "--reference", "a.csv", "--duration", "soon"}, "--duration 'soon'");
  expect_refused({"render", chain, "--size", "big"}, "--size 'big'");
  expect_refused({"render", chain, "--size", "0x100"}, "--size '0x100'");
  expect_refused({"render", chain, "--duration", "0.1", "--frame", "first"}, "--frame 'first'");
  expect_refused({"render", chain, "--duration", "0.1", "--frame", "7"}, "--frame 7: the last is 6");
  expect_refused({"render", chain, "--duration", "0.1", "--output", "missing"}, "no such folder");
  expect_refused({"video", chain, "--size", "33x33"}, "size 33x33");
  expect_refused({"render", chain, "--size", "32768x32768"}, "ask for at most 268435456 pixels");
  expect_refused({"video", chain, "--output", "film.avi"}, "film.avi: a film's name ends in .mp4");
  expect_refused({"video", chain, "--output", "film"}, "film: a film's name ends in .mp4");
  expect_refused({"video", chain, "--duration", "1e9"}, "duration");
  expect_refused({"video", chain, "--reference-substeps", "0"}, "reference sub-steps 0");
  expect_refused({"video", chain, "--panel", "a6"}, "panel a6: 'a6': give a1 to a5, reference, log:FILE");
  expect_refused({"video", chain, "--panel", "log:missing.poses.txt"}, "missing.poses.txt");
  expect_refused({"video", chain, "--panel", "reference", "--no-reference"}, "there is none");
  expect_refused({"video", chain, "--overlay", "forces"}, "--overlay 'forces': give some of trails");
  expect_refused({"video", chain, "--overlay", "error,velocity"}, "bodies have one colour");
  expect_refused({"video", chain, "--strip", "height"}, "--strip 'height': give some of error, gap, energy");
  expect_refused({"video", chain, "--freeze", "--no-reference"}, "there is none");
  expect_refused({"video", chain, "--end", "100"}, "--end 100: must be from --start to the end of the run");
  expect_refused({"video", chain, "--start", "1", "--end", "0.5"}, "--end 0.5: must be from --start");
  expect_refused({"video", chain, "--camera", "name:left"}, "has no such camera: ");
  expect_refused({"render", chain, chain}, "several are drawn with --layout sheet");
  expect_refused({"render", chain, "--layout", "collage"}, "--layout");
  expect_refused({"render", chain, "--panel", "a5"}, "--panel: is of use with --layout stills only");
  expect_refused({"render", chain, "--layout", "stills", "--columns", "2"},
                 "--columns: is of use with --layout sheet");
  expect_refused({"render", chain, "--layout", "stills"}, "--layout stills: give the columns' times");
  expect_refused({"render", chain, "--camera", "orbit:10"}, "a picture has no time to move in");
  expect_refused({"render", chain, "--time", "100"}, "--time 100: the run ends at");
  expect_refused({"video", chain, "--overlay", "ghost", "--no-reference"}, "there is none");
  expect_refused({"video", chain, "--camera", "follow:nobody"}, "has no such body: rod");
  expect_refused({"video", chain, "--start", "9"}, "start 9 s");
  expect_refused({"player", chain, "--output", "chain.htm"}, "chain.htm: give a name that ends in .html");
  expect_refused({"player", chain, "--output", "missing/a.html"}, "there is no folder missing");
  expect_refused({"player", chain, "--panel", "a6"}, "panel a6: 'a6': give a1 to a5, reference, log:FILE");
  expect_refused({"video", chain, "--loop", "loop.webp"}, "must be a .gif");
  expect_refused({"video", chain, "--poster", "missing/a.png"}, "there is no folder missing");
}

TEST_F(CommandLine, HelpExplainsSettingsAndCommands) {
  const Outcome settings = run({"help", "settings"});
  EXPECT_EQ(settings.exit_code, 0);
  for (const char* const key : {"substeps", "kappa", "contact_tau", "relaxation"}) {
    EXPECT_THAT(settings.out, HasSubstr(std::string("\n  ") + key + " "));
  }
  EXPECT_EQ(run({"help", "video"}).out, run({"video", "--help"}).out);
  EXPECT_EQ(run({"help"}).out, run({"--help"}).out);
}

TEST_F(CommandLine, BadScenesAreRefusedByEachCommandThatReadsThem) {
  const std::string good = scene_text("rod_chain.gltf");
  write("truncated.glb", std::string("glTF\x02\0\0\0\x00\x10\0\0\x00\x01\0\0JSON{\"asset\"", 33));
  write("truncated.gltf", good.substr(0, good.size() / 2));
  write("empty.gltf", "");
  write("no_such_body.gltf",
        changed(good, "\"connectedNode\"", "\"connectedNode\"", "\"connectedNode\": 9999, \"was\""));
  for (const char* const command : {"run", "render", "video", "info", "measure"}) {
    expect_refused({command, "not_there.gltf"}, "not_there.gltf");
    expect_refused({command, "truncated.glb"}, "truncated.glb");
    expect_refused({command, "truncated.gltf"}, "truncated.gltf");
    expect_refused({command, "empty.gltf"}, "empty.gltf");
    expect_refused({command, "no_such_body.gltf"}, "no_such_body.gltf");
    expect_refused({command, "."}, ".");
  }
}

TEST_F(CommandLine, BadPoseLogsAreRefused) {
  ASSERT_EQ(run({"run", scene("rod_chain.gltf"), "--duration", "0.1", "--output", "a.poses.txt"}).exit_code,
            0);
  const std::string log = content("a.poses.txt");
  write("cut.poses.txt", log.substr(0, log.size() - 5));
  write("nan.poses.txt", changed(log, "\npose 1 ", " 0", " nan"));
  write("other.poses.txt", changed(log, "scene-hash ", "scene-hash ", "scene-hash 0000"));
  const std::string chain = scene("rod_chain.gltf");
  expect_refused({"diff", "a.poses.txt", "not_there.poses.txt"},
                 "not_there.poses.txt: there is no such file");
  expect_refused({"diff", "a.poses.txt", "cut.poses.txt"}, "cut.poses.txt:");
  expect_refused({"diff", "a.poses.txt", "nan.poses.txt"}, "nan.poses.txt:");
  expect_refused({"diff", "a.poses.txt", chain}, "no pose log");
  expect_refused({"render", "a.poses.txt"}, "--scene FILE");
  expect_refused({"render", "cut.poses.txt", "--scene", chain}, "truncated");
  expect_refused({"render", "other.poses.txt", "--scene", chain}, "hash");
  expect_refused({"render", "a.poses.txt", "--scene", scene("box_stack.gltf")}, "another version");
}

}  // namespace
}  // namespace substep
