// Pictures and films that the program draws.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <tuple>

#include "program.h"
#include "render/image.h"

namespace substep::render {
namespace {

using testing::HasSubstr;

class Pictures : public Program {
 protected:
  /// Runs the program and expects that it succeeds.
  Outcome succeed(const std::vector<std::string>& arguments, const std::string& path = system_path()) const {
    const Outcome outcome = run(arguments, path);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome;
  }

  /// Draws one picture with these arguments.
  Image picture(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "render");
    arguments.insert(arguments.end(), {"--output", "picture.png"});
    succeed(arguments);
    return read_png(folder() / "picture.png");
  }

  /// Makes a small video of 0.2 s.
  Outcome short_video(const std::vector<std::string>& more, const std::string& path = system_path(),
                      const std::string& duration = "0.2") const {
    std::vector<std::string> arguments{
        "video", scene("rod_chain.gltf"), "--duration", duration, "--size", "320x180", "--hold", "0.1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments, path);
  }
};

bool is_white(const Image& image, int x, int y) {
  const std::uint8_t* const p = image.pixel(x, y);
  return p[0] + p[1] + p[2] == 3 * 255;
}

TEST_F(Pictures, ShowALogAsItsScene) {
  succeed(
      {"run", scene("rod_chain.gltf"), "--algorithm", "a4", "--duration", "0.2", "--output", "a.poses.txt"});
  succeed(
      {"render", "a.poses.txt", "--scene", scene("rod_chain.gltf"), "--frame", "0,12", "--size", "160x90"});
  const Image of_scene = picture({scene("rod_chain.gltf"), "--algorithm", "a4", "--duration", "0.2",
                                  "--frame", "12", "--size", "160x90"});
  EXPECT_THAT(files(), testing::ElementsAre("a.f0000.png", "a.f0012.png", "a.poses.txt", "picture.png"));
  EXPECT_EQ(content("a.f0012.png"), content("picture.png"));
  EXPECT_EQ(of_scene.width, 160);
  EXPECT_EQ(of_scene.height, 90);
  EXPECT_NE(content("a.f0000.png"), content("a.f0012.png"));  // the chain has moved
}

TEST_F(Pictures, ShowTheFrameNearestToATime) {
  EXPECT_EQ(picture({scene("pendulum.gltf"), "--time", "0.201", "--size", "160x90"}).rgb,
            picture({scene("pendulum.gltf"), "--frame", "12", "--size", "160x90"}).rgb);
}

TEST_F(Pictures, ShowEarlierMomentsLighterInAStrobe) {
  const std::string pendulum = scene("pendulum.gltf");
  const Image both =
      picture({pendulum, "--size", "160x90", "--camera", "fit", "--time", "0,0.5", "--layout", "strobe"});
  // The camera of the single picture fits the same frames.
  const Image last = picture({pendulum, "--size", "160x90", "--camera", "fit", "--time", "0.5"});
  int changed = 0;
  for (std::size_t i = 0; i < both.rgb.size(); ++i)
    changed += std::abs(both.rgb[i] - last.rgb[i]) > 8 ? 1 : 0;
  EXPECT_GT(changed, 300);   // the rod at the start
  EXPECT_LT(changed, 8000);  // of 43,200
  expect_refused({"render", pendulum, "--time", "0.5", "--layout", "strobe"},
                 "--layout strobe: needs at least two moments");
}

TEST_F(Pictures, ShowStillsByRunAndTime) {
  const std::vector<std::string> stills{"render", "--layout", "stills", scene("rod_chain.gltf")};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), stills.begin(), stills.end());
    return more;
  };
  const Outcome made = succeed(with({"--panel", "a5,n=2", "--panel", "reference", "--time", "0.2,0", "--size",
                                     "64x36", "--output", "stills.png"}));
  EXPECT_THAT(made.out, testing::ContainsRegex("A5  n=2 m=1 [^\n]* ~[0-9]"));
  EXPECT_THAT(made.out, HasSubstr("wrote stills.png"));
  const Image sheet = read_png(folder() / "stills.png");
  // Text of 16 pixels: gaps of 8, lines of 22; a legend, then the times.
  EXPECT_EQ(sheet.width, 8 + 2 * (64 + 8));
  EXPECT_EQ(sheet.height, 8 + 2 * 22 + 2 * (22 + 36 + 8));
  for (const auto& [x, y] : {std::pair{10, 78}, {140, 78}, {10, 144}, {140, 144}})
    EXPECT_FALSE(is_white(sheet, x, y));
  EXPECT_TRUE(is_white(sheet, 76, 78));  // between the first two
  for (int y = 74; y < 82; ++y) EXPECT_EQ(sheet.pixel(20, y)[0], sheet.pixel(20, y + 66)[0]);  // the start
  const Outcome page = succeed(with(
      {"--panel", "a5", "--time", "0", "--width", "one-column", "--dpi", "200", "--output", "stills.pdf"}));
  EXPECT_THAT(page.out, HasSubstr("85.0 mm wide at 200 pixels an inch"));
  EXPECT_THAT(content("stills.pdf"), HasSubstr("MediaBox[0 0 240.9449 "));
  // 85 mm at 100 dpi are 334 pixels.
  succeed(with({"--no-reference", "--panel", "a1", "--time", "0,0.1", "--width", "one-column", "--dpi", "100",
                "--output", "print.png"}));
  EXPECT_NEAR(read_png(folder() / "print.png").width, 334, 1);
  expect_refused(with({"--time", "9"}), "--time '9': must be from 0 to the end of the run, 5 s");
  expect_refused(with({"--time", "now"}), "--time 'now'");
  expect_refused(with({"--time", "0", "--output", "stills.svg"}), "give a name that ends in .png");
  expect_refused(with({"--time", "0", "--size", "32768x32768"}), "is too large");
}

TEST_F(Pictures, LeaveAFiguresEdgesWhite) {
  succeed(
      {"report", "figure", "stability", "--width", "one-column", "--dpi", "150", "--output", "figure.png"});
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
  const Image image = picture({"square.gltf", "--camera", "name:front", "--size", "64x64"});
  for (const auto& [x, y] : {std::pair(2, 2), std::pair(32, 32), std::pair(61, 61)}) {
    EXPECT_GE(image.pixel(x, y)[0], 254);
    EXPECT_EQ(image.pixel(x, y)[1], 0);
  }
}

TEST_F(Pictures, FreezeWhereARunDiverges) {
  const auto frames = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"video",    scene("rod_chain.gltf"),
                                       "--panel",  "a5,n=1",
                                       "--size",   "320x180",
                                       "--hold",   "0",
                                       "--start",  "0.2",
                                       "--end",    "0.6",
                                       "--fps",    "10",
                                       "--frames", "film"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_THAT(succeed(arguments).out, HasSubstr("CPU time: simulate"));
    return files().size();
  };
  const std::size_t moving = frames({});
  EXPECT_EQ(moving, 1u + 5u);                    // the folder, and the frames at 0.2 … 0.6 s
  EXPECT_EQ(frames({"--freeze"}), moving + 15);  // 1.5 s more
}

TEST_F(Pictures, ShowEachSceneOnceOnASheet) {
  succeed({"render", "--layout", "sheet", scene("rod_chain.gltf"), scene("pendulum.gltf"),
           scene("incline.gltf"), "--columns", "2", "--size", "64x36", "--output", "sheet.png"});
  const Image sheet = read_png(folder() / "sheet.png");
  EXPECT_EQ(sheet.width, 8 + 2 * (64 + 8));
  EXPECT_EQ(sheet.height, 8 + 2 * (36 + 22));
  // Two pictures are in the upper row, one in the lower.
  for (const auto& [x, y] : {std::pair{8 + 32, 8 + 18}, {80 + 32, 8 + 18}, {8 + 32, 66 + 18}})
    EXPECT_FALSE(is_white(sheet, x, y)) << x << " " << y;
  EXPECT_TRUE(is_white(sheet, 80 + 32, 66 + 18));
  expect_refused(
      {"render", "--layout", "sheet", scene("rod_chain.gltf"), "no_such.gltf", "--output", "other.png"},
      "no_such.gltf");
}

TEST_F(Pictures, ShowAllFramesOfALog) {
  const std::string pendulum = scene("pendulum.gltf");
  succeed({"run", pendulum, "--duration", "0.2", "--every", "5", "--output", "p.poses.txt"});
  succeed({"render", "p.poses.txt", "--scene", pendulum, "--frame", "all", "--size", "64x36"});
  EXPECT_THAT(files(), testing::ElementsAre("p.f0000.png", "p.f0005.png", "p.f0010.png", "p.f0012.png",
                                            "p.poses.txt"));
  expect_refused({"render", "p.poses.txt", "--scene", pendulum, "--frame", "7"},
                 "--frame 7: the log has poses every 5 frames only: ask for 5");
}

TEST_F(Pictures, SimulateOnlyShownFrames) {
  const auto start = std::chrono::steady_clock::now();
  picture({scene("rod_chain.gltf"), "--duration", "100000", "--frame", "1", "--size", "64x36"});
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_LT(seconds.count(), 20);  // measured 0.3; all 6 million steps: minutes
}

TEST_F(Pictures, BecomeAFilmOfTheDurationAndSize) {
  const Outcome outcome = short_video({});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("from the reference: own, order 8, h=1/960"));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("A5  n=10 m=1 .* 1080 +~[0-9]"));
  EXPECT_THAT(outcome.out, HasSubstr("wrote rod_chain.mp4"));
  EXPECT_THAT(files(), testing::ElementsAre("rod_chain.mp4"));
  const Outcome probe = run_command(
      "ffprobe -v error -count_frames -select_streams v -show_entries "
      "stream=codec_name,width,height,pix_fmt,r_frame_rate,nb_read_frames -of csv=p=0 " +
      quoted((folder() / "rod_chain.mp4").string()));
  // 0.2 s are frames 0 to 6, and the last is held for 3 more.
  EXPECT_EQ(probe.out, "h264,320,180,yuv420p,30/1,10\n");
}

TEST_F(Pictures, BecomeTheContainerOfTheExtension) {
  // The test above covers MP4.
  for (const auto& [extension, format, codec] :
       {std::tuple{"webm", "matroska,webm", "vp9"}, std::tuple{"gif", "gif", "gif"},
        std::tuple{"apng", "apng", "apng"}}) {
    const std::string film = std::string("film.") + extension;
    const Outcome outcome = short_video({"--output", film}, system_path(), "0.1");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const Outcome probe = run_command(
        "ffprobe -v error -count_frames -show_entries stream=codec_name,nb_read_frames:format=format_name "
        "-of default=noprint_wrappers=1:nokey=1 " +
        quoted((folder() / film).string()));
    EXPECT_EQ(probe.out, fmt::format("{}\n7\n{}\n", codec, format)) << film;
  }
}

TEST_F(Pictures, BecomeAFolderOfAFilmNamedPng) {
  ASSERT_EQ(short_video({"--output", "film.png"}).exit_code, 0);
  EXPECT_EQ(files().size(), 11u);
  EXPECT_EQ(read_png(folder() / "film" / "frame_0009.png").width, 320);
}

TEST_F(Pictures, MatchForAnyThreadCount) {
  for (const char* const threads : {"1", "2", "3"}) {
    ASSERT_EQ(short_video({"--threads", threads, "--output", std::string(threads) + ".mp4"}).exit_code, 0);
  }
  EXPECT_EQ(content("1.mp4"), content("2.mp4"));
  EXPECT_EQ(content("1.mp4"), content("3.mp4"));
}

TEST_F(Pictures, NeedFfmpegForAFilmButNotForFrames) {
  write("film.mp4", "an earlier film");
  const Outcome refused = short_video({"--output", "film.mp4"}, "/nowhere");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("film.mp4: a film needs ffmpeg, which is not in PATH"));
  EXPECT_EQ(content("film.mp4"), "an earlier film");
  EXPECT_EQ(files(), std::vector<std::string>{"film.mp4"});
  std::filesystem::remove(folder() / "film.mp4");
  EXPECT_EQ(short_video({"--frames", "frames", "--loop", "loop.gif"}, "/nowhere").exit_code, 2);

  const Outcome outcome = short_video({"--output", "film.mp4", "--frames", "frames"}, "/nowhere");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("wrote frames\n"));
  EXPECT_EQ(read_png(folder() / "frames" / "frame_0009.png").width, 320);
  // The printed command makes the film from the frames.
  const std::string start = "to make a film of these frames: ";
  std::string command = outcome.out.substr(outcome.out.find(start) + start.size());
  command = command.substr(0, command.find('\n'));
  const Outcome film = run_command("cd " + quoted(folder().string()) + " && " + command);
  ASSERT_EQ(film.exit_code, 0) << film.err;
  ASSERT_EQ(short_video({"--output", "direct.mp4"}).exit_code, 0);
  EXPECT_EQ(content("film.mp4"), content("direct.mp4"));
}

TEST_F(Pictures, ReplaceAFolderOfFramesAlone) {
  ASSERT_EQ(short_video({"--frames", "frames"}).exit_code, 0);
  EXPECT_EQ(files().size(), 11u);
  ASSERT_EQ(short_video({"--frames", "frames"}, system_path(), "0.1").exit_code, 0);
  EXPECT_EQ(files().size(), 8u);
  write("frames/thesis.tex", "years of work");
  EXPECT_EQ(short_video({"--frames", "frames"}).exit_code, 2);
  EXPECT_EQ(content("frames/thesis.tex"), "years of work");
  EXPECT_EQ(files().size(), 9u);
}

TEST_F(Pictures, BecomeAPosterAndALoop) {
  const Outcome outcome = short_video({"--poster", "poster.png", "--loop", "loop.gif"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(files(), testing::ElementsAre("loop.gif", "poster.png", "rod_chain.mp4"));
  EXPECT_EQ(read_png(folder() / "poster.png").height, 180);
  EXPECT_EQ(content("loop.gif").substr(0, 6), "GIF89a");
  EXPECT_LE(content("loop.gif").size(), 2'000'000u);
}

}  // namespace
}  // namespace substep::render
