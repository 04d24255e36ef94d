#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "program.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

using testing::HasSubstr;

class CommandLine : public Program {
 protected:
  /// Returns the scene's text with the first `from` after `after` replaced.
  static std::string changed(std::string text, const std::string& after, const std::string& from,
                             const std::string& to) {
    const std::size_t start = text.find(after);
    EXPECT_NE(start, std::string::npos) << after;
    const std::size_t at = text.find(from, start);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
};

/// Returns the names under "Subcommands:", in the order of the help.
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

TEST_F(CommandLine, HelpHasExampleOfEachCommand) {
  const std::string all = printed("--help");
  const std::vector<std::string> commands = commands_in(all);
  EXPECT_THAT(commands,
              testing::UnorderedElementsAre("run", "render", "video", "player", "export", "info", "diff",
                                            "check", "approve", "init", "measure", "sweep", "report"));
  for (const std::string& command : commands) {
    const Outcome one = shell(command + " --help");
    EXPECT_EQ(one.exit_code, 0);
    EXPECT_THAT(one.out, HasSubstr("Example:\n  substep " + command + " "));
    EXPECT_EQ(one.err, "");
  }
}

TEST_F(CommandLine, PrintsVersion) {
  EXPECT_THAT(printed("--version"), testing::MatchesRegex("substep [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

/// Command lines on a scene c.gltf, and words of their refusals.
const std::vector<std::pair<const char*, const char*>> refusals{
    {"", "a command is needed"},
    {"walk", "walk"},
    {"rendr", "'rendr' is no command: did you mean 'render'?"},
    {"help rendr", "did you mean 'render'?"},
    {"run c.gltf --subteps 4", "--subteps: did you mean --substeps?"},
    {"run c.gltf --setp 1/60", "--setp: did you mean --step?"},
    {"run", "scene"},
    {"run c.gltf --speed 3", "--speed"},
    {"run c.gltf --copies 3", "c.gltf: is a scene"},
    {"run c.gltf --rotate 1,2", "--rotate"},
    {"run c.gltf --algorithm a6", "--algorithm 'a6': give a1, a2, a3, a4, a5, soft or avbd"},
    {"run c.gltf --set joints=loose", "--set 'joints=loose': give rows, plain or stable"},
    {"run c.gltf --step 1/0", "--step '1/0'"},
    {"run c.gltf --step soon", "--step 'soon'"},
    {"run c.gltf --step 0", "step 0"},
    {"run c.gltf --step -1/60", "step"},
    {"run c.gltf --step nan", "--step 'nan'"},
    {"run c.gltf --substeps 0", "substeps 0"},
    {"run c.gltf --substeps many", "--substeps"},
    {"run c.gltf --substeps 99999999999999", "--substeps"},
    {"run c.gltf --set tau=nan", "tau"},
    {"run c.gltf --set tau=0.6/0.9/0.3", "--set 'tau=0.6/0.9/0.3': give a number, or two as in 0.6/0.9"},
    {"run c.gltf --mass 2 --density 3", "--density excludes --mass"},
    {"run c.gltf --set kappa=0", "kappa 0"},
    {"run c.gltf --set tau", "--set 'tau': give KEY=VALUE"},
    {"run c.gltf --set mass=3", "--set 'mass': give some of step, substeps"},
    {"run c.gltf --duration -1", "--duration '-1'"},
    {"run c.gltf --duration 1e300", "too many"},
    {"run c.gltf --every 0", "every 0 frames"},
    {"run c.gltf --output missing/a.poses.txt", "there is no folder missing"},
    {"run c.gltf --csv missing/a.csv", "there is no folder missing"},
    {"measure c.gltf --reference missing/a.csv", "there is no folder missing"},
    {"measure c.gltf --reference a.csv --duration 0", "duration 0 s: from the scene's step"},
    {"measure c.gltf --reference a.csv --duration soon", "--duration 'soon'"},
    {"render c.gltf --size big", "--size 'big'"},
    {"render c.gltf --size 0x100", "--size '0x100'"},
    {"render c.gltf --duration 0.1 --frame first", "--frame 'first'"},
    {"render c.gltf --duration 0.1 --frame 7", "--frame 7: the last is 6"},
    {"render c.gltf --duration 0.1 --output a.jpg",
     "there is no such folder, and a picture's name ends in .png"},
    {"video c.gltf --size 33x33", "size 33x33"},
    {"render c.gltf --size 32768x32768", "ask for at most 268435456 pixels"},
    {"video c.gltf --output film.avi", "film.avi: a film's name ends in .mp4"},
    {"video c.gltf --output film", "film: a film's name ends in .mp4"},
    {"video c.gltf --duration 1e9", "duration"},
    {"video c.gltf --reference-substeps 0", "reference sub-steps 0"},
    {"video c.gltf --panel a6", "panel a6: 'a6': give a1 to a5, soft, avbd, reference, log:FILE"},
    {"video c.gltf --panel log:missing.poses.txt", "missing.poses.txt"},
    {"video c.gltf --panel reference --no-reference", "there is none"},
    {"video c.gltf --overlay forces", "--overlay 'forces': give some of trails"},
    {"video c.gltf --overlay error,velocity", "bodies have one colour"},
    {"video c.gltf --strip height", "--strip 'height': give some of error, gap, energy"},
    {"video c.gltf --freeze --no-reference", "there is none"},
    {"video c.gltf --strip energy,error --no-reference", "there is none"},
    {"video c.gltf --end 100", "--end 100: must be from --start to the end of the run"},
    {"video c.gltf --start 1 --end 0.5", "--end 0.5: must be from --start"},
    {"video c.gltf --camera name:left", "has no such camera: "},
    {"render c.gltf c.gltf", "several are drawn with --layout sheet"},
    {"render c.gltf --layout collage", "--layout"},
    {"render c.gltf --panel a5", "--panel: only with --layout stills"},
    {"render c.gltf --layout stills --columns 2", "--columns: only with --layout sheet"},
    {"render c.gltf --layout stills --time 0 --algorithm a2", "--algorithm: not with --layout stills"},
    {"render c.gltf --layout sheet --time 1", "--time: not with --layout sheet"},
    {"render c.gltf --layout stills", "--layout stills: give the columns' times"},
    {"render c.gltf --layout stills --time 9", "--time '9': must be from 0 to the end of the run, 5 s"},
    {"render c.gltf --layout stills --time now", "--time 'now'"},
    {"render c.gltf --layout stills --time 0 --output stills.svg", "give a name that ends in .png"},
    {"render c.gltf --layout stills --time 0 --size 32768x32768", "is too large"},
    {"render c.gltf --layout strobe --time 0.5", "--layout strobe: needs at least two moments"},
    {"render c.gltf --camera orbit:10", "a picture has no time to move in"},
    {"render c.gltf --time 100", "--time 100: the run ends at"},
    {"video c.gltf --overlay ghost --no-reference", "there is none"},
    {"video c.gltf --camera follow:nobody", "has no such body: rod"},
    {"video c.gltf --start 9", "start 9 s"},
    {"player c.gltf --output chain.htm", "chain.htm: give a name that ends in .html"},
    {"player c.gltf --output missing/a.html", "there is no folder missing"},
    {"video c.gltf --loop loop.webp", "must be a .gif"},
    {"video c.gltf --poster poster.jpg", "--poster poster.jpg: must be a .png file"},
    {"video c.gltf --hold nan", "--hold: 'nan': give a number from 0 to 60"},
    {"video c.gltf --fps 60 --output a.gif", "--fps 60: a .gif has at most 50 frames a second"},
    {"video c.gltf --fps nan", "--fps: 'nan': give a number from 1 to 240"},
    {"player c.gltf --speed nan", "--speed: 'nan'"},
    {"export c.gltf --rate nan", "--rate: 'nan'"},
    {"render c.gltf --layout stills --width 85 --text nan", "--text: 'nan'"},
    {"render c.gltf --layout stills --width 85 --dpi 1e400", "--dpi: '1e400'"},
    {"video c.gltf --poster missing/a.png", "there is no folder missing"}};

TEST_F(CommandLine, RefusesBadOptions) {
  copy_scene("rod_chain.gltf", "c.gltf");
  for (const auto& [words, part] : refusals) refuses(words, part);
  write("panels.toml", "[[panel]]\nalgorithm = \"a5\"\n");
  refuses("player c.gltf --panels panels.toml", "give 'show' or 'command'");
}

TEST_F(CommandLine, HelpTakesCommands) {
  EXPECT_EQ(shell("help video").out, shell("video --help").out);
  EXPECT_EQ(shell("help").out, shell("--help").out);
}

TEST_F(CommandLine, RefusesBadScenesInEachCommand) {
  const std::string good = content_of(scene("rod_chain.gltf")).value();
  write("truncated.glb", std::string("glTF\x02\0\0\0\x00\x10\0\0\x00\x01\0\0JSON{\"asset\"", 33));
  write("truncated.gltf", good.substr(0, good.size() / 2));
  write("empty.gltf", "");
  write("no_such_body.gltf",
        changed(good, "\"connectedNode\"", "\"connectedNode\"", "\"connectedNode\": 9999, \"was\""));
  for (const std::string command : {"run ", "render ", "video ", "info ", "measure "}) {
    for (const char* const file :
         {"not_there.gltf", "truncated.glb", "truncated.gltf", "empty.gltf", "no_such_body.gltf", "."})
      refuses(command + file, file);
  }
}

TEST_F(CommandLine, RefusesBadPoseLogs) {
  printed("run $S/rod_chain.gltf --duration 0.1 --output a.poses.txt");
  const std::string log = content("a.poses.txt");
  write("cut.poses.txt", log.substr(0, log.size() - 5));
  write("other.poses.txt", changed(log, "scene-hash ", "scene-hash ", "scene-hash 0000"));
  for (const auto& [words, part] :
       {std::pair("diff a.poses.txt not_there.poses.txt", "not_there.poses.txt: there is no such file"),
        {"diff a.poses.txt cut.poses.txt", "cut.poses.txt:"},
        {"diff a.poses.txt $S/rod_chain.gltf", "no pose log"},
        {"render a.poses.txt", "--scene FILE"},
        {"render a.poses.txt --scene $S/rod_chain.gltf --set tau=1", "--set: a.poses.txt is a finished run"},
        {"export a.poses.txt --algorithm a5", "--algorithm: a.poses.txt is a finished run"},
        {"render cut.poses.txt --scene $S/rod_chain.gltf", "truncated"},
        {"render other.poses.txt --scene $S/rod_chain.gltf", "hash"},
        {"render a.poses.txt --scene $S/box_stack.gltf", "another version"}})
    refuses(words, part);
}

}  // namespace
}  // namespace substep
