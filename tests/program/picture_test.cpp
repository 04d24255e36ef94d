// Pictures and films that the program draws.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <utility>

#include "program.h"
#include "render/image.h"

namespace substep::render {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Pictures : public Program {
 protected:
  /// Draws one picture with these words of a command line.
  Image picture(const std::string& words) const {
    printed("render " + words + " --output picture.png");
    return read_png(folder() / "picture.png");
  }

  /// Returns the command line of a small film of 0.2 s.
  static std::string film(const std::string& more) {
    return "$P video $S/rod_chain.gltf --duration 0.2 --size 320x180 --hold 0.1 " + more;
  }
  /// Makes the small film and returns what is printed.
  std::string made_film(const std::string& more) const {
    const Outcome outcome = command(film(more));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }

  /// Returns what ffprobe prints of a film's entries, separated by commas.
  std::string probed(const std::string& entries, const std::string& file) const {
    return command("ffprobe -v error -count_frames -show_entries " + entries + " -of csv=p=0:s=, " + file)
        .out;
  }
};

bool is_white(const Image& image, int x, int y) {
  const std::uint8_t* const p = image.pixel(x, y);
  return p[0] + p[1] + p[2] == 3 * 255;
}

TEST_F(Pictures, ShowALogAsItsScene) {
  printed("run $S/rod_chain.gltf --algorithm a4 --duration 0.2 --output a.poses.txt");
  printed("render a.poses.txt --scene $S/rod_chain.gltf --frame 0,12 --size 160x90");
  const Image of_scene = picture("$S/rod_chain.gltf --algorithm a4 --duration 0.2 --frame 12 --size 160x90");
  EXPECT_THAT(files(), ElementsAre("a.f0000.png", "a.f0012.png", "a.poses.txt", "picture.png"));
  EXPECT_EQ(content("a.f0012.png"), content("picture.png"));
  EXPECT_EQ(of_scene.width, 160);
  EXPECT_EQ(of_scene.height, 90);
  EXPECT_NE(content("a.f0000.png"), content("a.f0012.png"));  // the chain has moved
}

TEST_F(Pictures, ShowTheFrameNearestToATime) {
  EXPECT_EQ(picture("$S/pendulum.gltf --time 0.201 --size 160x90").rgb,
            picture("$S/pendulum.gltf --frame 12 --size 160x90").rgb);
  // The last frame, 30, has poses.
  printed("run $S/pendulum.gltf --duration 0.25 --step 1/120 --every 8 --output a.poses.txt");
  const std::string log = "a.poses.txt --scene $S/pendulum.gltf --size 160x90 ";
  EXPECT_EQ(picture(log + "--time 0.24").rgb, picture(log + "--frame 30").rgb);
  EXPECT_EQ(picture(log + "--time 0.22").rgb, picture(log + "--frame 24").rgb);
}

TEST_F(Pictures, ShowEarlierMomentsLighterInAStrobe) {
  const std::string pendulum = "$S/pendulum.gltf --size 160x90 --camera fit ";
  const Image both = picture(pendulum + "--time 0,0.5 --layout strobe");
  // The camera of the single picture fits the same frames.
  const Image last = picture(pendulum + "--time 0.5");
  int changed = 0;
  for (std::size_t i = 0; i < both.rgb.size(); ++i)
    changed += std::abs(both.rgb[i] - last.rgb[i]) > 8 ? 1 : 0;
  EXPECT_GT(changed, 300);   // the rod at the start
  EXPECT_LT(changed, 8000);  // of 43,200
}

TEST_F(Pictures, ShowStillsByRunAndTime) {
  const std::string stills = "render --layout stills $S/rod_chain.gltf ";
  const std::string made =
      printed(stills + "--panel a5,n=2 --panel reference --time 0.2,0 --size 64x36 --output stills.png");
  EXPECT_THAT(made, testing::ContainsRegex("A5  n=2 m=1 [^\n]* ~[0-9]"));
  EXPECT_THAT(made, HasSubstr("wrote stills.png"));
  const Image sheet = read_png(folder() / "stills.png");
  // Text of 16 pixels: gaps of 8, lines of 22; a legend, then the times.
  EXPECT_EQ(sheet.width, 8 + 2 * (64 + 8));
  EXPECT_EQ(sheet.height, 8 + 2 * 22 + 2 * (22 + 36 + 8));
  for (const auto& [x, y] : {std::pair{10, 78}, {140, 78}, {10, 144}, {140, 144}})
    EXPECT_FALSE(is_white(sheet, x, y));
  EXPECT_TRUE(is_white(sheet, 76, 78));  // between the first two
  for (int y = 74; y < 82; ++y) EXPECT_EQ(sheet.pixel(20, y)[0], sheet.pixel(20, y + 66)[0]);  // the start
  expect(stills + "--panel a5 --time 0 --width one-column --dpi 200 --output stills.pdf", 0,
         {"85.0 mm wide at 200 pixels an inch"});
  EXPECT_THAT(content("stills.pdf"), HasSubstr("MediaBox[0 0 240.9449 "));
  // 85 mm at 100 dpi are 334 pixels.
  printed(stills + "--no-reference --panel a1 --time 0,0.1 --width one-column --dpi 100 --output print.png");
  EXPECT_NEAR(read_png(folder() / "print.png").width, 334, 1);
}

TEST_F(Pictures, LeaveAFiguresEdgesWhite) {
  printed("report figure stability --width one-column --dpi 150 --output figure.png");
  const Image figure = read_png(folder() / "figure.png");
  EXPECT_NEAR(figure.width, 85 / 25.4 * 150, 1);
  for (const int x : {0, 1, 2, figure.width - 3, figure.width - 2, figure.width - 1}) {
    for (int y = 0; y < figure.height; ++y) ASSERT_EQ(figure.pixel(x, y)[1], 255) << x << " " << y;
  }
}

TEST_F(Pictures, ShowAFileWithoutPhysics) {
  // A camera at 1 m sees a red square of 2 m to its edges.
  const std::string start = R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}], "nodes": [
    {"mesh": 0}, {"camera": 0, "name": "front", "translation": [0, 0, 1]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 1.5707963, "znear": 0.1}}],
    "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]},
                   "extensions": {"KHR_materials_unlit": {}}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5, "material": 0}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 48}],
    "buffers": [{"byteLength": 48, "uri": "data:;base64,)";
  write("square.gltf", start + "AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAACAvwAAgD8AAAAAAACAPwAAgD8AAAAA\"}]}");
  const Image image = picture("square.gltf --camera name:front --size 64x64");
  for (const auto& [x, y] : {std::pair(2, 2), std::pair(32, 32), std::pair(61, 61)}) {
    EXPECT_GE(image.pixel(x, y)[0], 254);
    EXPECT_EQ(image.pixel(x, y)[1], 0);
  }
}

TEST_F(Pictures, FreezeWhereARunDiverges) {
  const auto frames = [&](const std::string& more) {
    expect(
        "video $S/rod_chain.gltf --panel a5,n=1 --size 320x180 --hold 0 --start 0.2 --end 0.6 --fps 10 "
        "--frames film " +
            more,
        0, {"wrote film"});
    return files().size();
  };
  const std::size_t moving = frames("");
  EXPECT_EQ(moving, 1u + 5u);                  // the folder, and the frames at 0.2 … 0.6 s
  EXPECT_EQ(frames("--freeze"), moving + 15);  // 1.5 s more
}

TEST_F(Pictures, FollowABodyFromItsStart) {
  const auto at_the_end = [&](const std::string& start, const std::string& frame) {
    printed(
        "video $S/pendulum.gltf --panel a5 --no-reference --camera follow:rod --size 320x180 --hold 0 --fps "
        "10 "
        "--end 0.2 --frames film --start " +
        start);
    return read_png(folder() / "film" / frame);
  };
  const Image whole = at_the_end("0", "frame_0002.png");
  const Image late = at_the_end("0.1", "frame_0001.png");
  // Below the title and the number of the frame.
  for (int y = 50; y < 170; ++y) {
    for (int x = 0; x < 320; ++x) ASSERT_EQ(whole.pixel(x, y)[1], late.pixel(x, y)[1]) << x << " " << y;
  }
}

TEST_F(Pictures, DrawTrailsOfTheScenesLastSecond) {
  const auto last_frame = [&](const std::string& rate) {
    printed(
        "video $S/pendulum.gltf --panel a5 --no-reference --overlay trails --size 320x180 --hold 0 --end 1 "
        "--frames film " +
        rate);
    return content("film/frame_0010.png");
  };
  EXPECT_EQ(last_frame("--fps 10"), last_frame("--fps 5 --speed 0.5"));
}

TEST_F(Pictures, NameALastFrameBeforeTheEnd) {
  expect(
      "video $S/pendulum.gltf --panel a5 --no-reference --size 320x180 --fps 10 --duration 0.25 --frames "
      "film",
      0, {"the last frame is at 0.2 s, before the end at 0.25 s\n"});
}

TEST_F(Pictures, ShowEachSceneOnceOnASheet) {
  printed(
      "render --layout sheet $S/rod_chain.gltf $S/pendulum.gltf $S/incline.gltf --columns 2 --size 64x36 "
      "--output sheet.png");
  const Image sheet = read_png(folder() / "sheet.png");
  EXPECT_EQ(sheet.width, 8 + 2 * (64 + 8));
  EXPECT_EQ(sheet.height, 8 + 2 * (36 + 22));
  // Two pictures are in the upper row, one in the lower.
  for (const auto& [x, y] : {std::pair{8 + 32, 8 + 18}, {80 + 32, 8 + 18}, {8 + 32, 66 + 18}})
    EXPECT_FALSE(is_white(sheet, x, y)) << x << " " << y;
  EXPECT_TRUE(is_white(sheet, 80 + 32, 66 + 18));
  refuses("render --layout sheet $S/rod_chain.gltf no_such.gltf --output other.png", "no_such.gltf");
}

TEST_F(Pictures, ShowAllFramesOfALog) {
  printed("run $S/pendulum.gltf --duration 0.2 --every 5 --output p.poses.txt");
  printed("render p.poses.txt --scene $S/pendulum.gltf --frame all --size 64x36");
  EXPECT_THAT(files(),
              ElementsAre("p.f0000.png", "p.f0005.png", "p.f0010.png", "p.f0012.png", "p.poses.txt"));
  refuses("render p.poses.txt --scene $S/pendulum.gltf --frame 7",
          "--frame 7: the log has poses every 5 frames only: ask for 5");
}

TEST_F(Pictures, SimulateOnlyShownFrames) {
  const auto start = std::chrono::steady_clock::now();
  picture("$S/rod_chain.gltf --duration 100000 --frame 1 --size 64x36");
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_LT(seconds.count(), 20);  // measured 0.3; all 6 million steps: minutes
}

TEST_F(Pictures, BecomeAFilmOfTheDurationAndSize) {
  const Outcome outcome = command(film(""));
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("from the reference: own, order 8, h=1/960"));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("A5  n=10 m=1 .* 1080 +~[0-9]"));
  EXPECT_THAT(outcome.out, HasSubstr("wrote rod_chain.mp4"));
  EXPECT_THAT(files(), ElementsAre("rod_chain.mp4"));
  // 0.2 s are frames 0 to 6, and the last is held for 3 more.
  EXPECT_EQ(probed("stream=codec_name,width,height,pix_fmt,r_frame_rate,nb_read_frames", "rod_chain.mp4"),
            "h264,320,180,yuv420p,30/1,10\n");
}

TEST_F(Pictures, BecomeTheContainerOfTheExtension) {
  // The test above covers MP4.
  for (const auto& [file, streams] : {std::pair{"film.webm", "vp9,10\n\"matroska,webm\"\n"},
                                      {"film.gif", "gif,10\ngif\n"},
                                      {"film.apng", "apng,10\napng\n"}}) {
    made_film(std::string("--output ") + file);
    EXPECT_EQ(probed("stream=codec_name,nb_read_frames:format=format_name", file), streams);
  }
}

TEST_F(Pictures, BecomeAFolderOfAFilmNamedPng) {
  made_film("--output film.png");
  EXPECT_EQ(files().size(), 11u);
  EXPECT_EQ(read_png(folder() / "film" / "frame_0009.png").width, 320);
}

TEST_F(Pictures, MatchForAnyThreadCount) {
  for (const std::string threads : {"1", "2", "3"})
    made_film("--threads " + threads + " --output " + threads + ".mp4");
  EXPECT_EQ(content("1.mp4"), content("2.mp4"));
  EXPECT_EQ(content("1.mp4"), content("3.mp4"));
}

TEST_F(Pictures, NeedFfmpegForAFilmButNotForFrames) {
  write("film.mp4", "an earlier film");
  const auto without_ffmpeg = [&](const std::string& more) { return command("PATH=/nowhere " + film(more)); };
  const Outcome refused = without_ffmpeg("--output film.mp4");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("film.mp4: a film needs ffmpeg, which is not in PATH"));
  EXPECT_EQ(content("film.mp4"), "an earlier film");
  EXPECT_THAT(files(), ElementsAre("film.mp4"));
  std::filesystem::remove(folder() / "film.mp4");
  EXPECT_EQ(without_ffmpeg("--frames frames --loop loop.gif").exit_code, 2);

  const Outcome outcome = without_ffmpeg("--output film.mp4 --frames frames");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("wrote frames\n"));
  EXPECT_EQ(read_png(folder() / "frames" / "frame_0009.png").width, 320);
  // The printed command makes the film from the frames.
  const std::string start = "to make a film of these frames: ";
  const std::string printed_command = outcome.out.substr(outcome.out.find(start) + start.size());
  const Outcome made = command(printed_command.substr(0, printed_command.find('\n')));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  made_film("--output direct.mp4");
  EXPECT_EQ(content("film.mp4"), content("direct.mp4"));
}

TEST_F(Pictures, ReplaceAFolderOfFramesAlone) {
  made_film("--frames frames");
  EXPECT_EQ(files().size(), 11u);
  made_film("--frames frames --end 0.1");
  EXPECT_EQ(files().size(), 8u);
  write("frames/thesis.tex", "years of work");
  EXPECT_EQ(command(film("--frames frames")).exit_code, 2);
  EXPECT_EQ(content("frames/thesis.tex"), "years of work");
  EXPECT_EQ(files().size(), 9u);
}

TEST_F(Pictures, SolvePanelsAsTheirAlgorithmsRun) {
  expect("render $S/four_bar.gltf --layout stills --time 0 --no-reference --panel a5 --panel a2", 0,
         {"A5  n=40 m=1 τ=0.6/0.9 κ=1/0.7 stable  h=1/60", "A2  m=200  h=1/60"});
}

TEST_F(Pictures, BecomeAPosterAndALoop) {
  made_film("--poster poster.png --loop loop.gif");
  EXPECT_THAT(files(), ElementsAre("loop.gif", "poster.png", "rod_chain.mp4"));
  EXPECT_EQ(read_png(folder() / "poster.png").height, 180);
  EXPECT_EQ(content("loop.gif").substr(0, 6), "GIF89a");
  EXPECT_LE(content("loop.gif").size(), 2'000'000u);
  // Every third of seven frames: every second one would be 60 frames a second.
  made_film("--fps 120 --end 0.05 --loop loop.gif");
  EXPECT_EQ(std::stoi(probed("stream=nb_read_frames", "loop.gif")), 3);
}

}  // namespace
}  // namespace substep::render
