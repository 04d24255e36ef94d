// Films: files that get their names only when complete, times of frames, cameras.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "program.h"
#include "render/video/ffmpeg.h"
#include "render/video/film_camera.h"
#include "render/video/film_painter.h"
#include "render/video/recorded_run.h"
#include "sim/error.h"
#include "sim/measure/motion.h"
#include "tests/error_message.h"
#include "tests/scene_files.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class FilmFiles : public Program {
 protected:
  FilmFiles() {
    fs::create_directory(folder() / "bin");
    write("a.mp4", "an earlier film");
  }

  /// Replaces ffmpeg by a script.
  void fake(const std::string& script) const {
    write("bin/ffmpeg", "#!/bin/sh\n" + script);
    fs::permissions(folder() / "bin/ffmpeg", fs::perms::owner_all);
  }
};

TEST_F(FilmFiles, KeepsOldFileWhereFfmpegFails) {
  const std::string cut = fmt::format(
      "{} \"$@\" || exit\nfor last; do :; done\n"
      "case $last in file:*) truncate -s -1000 \"${{last#file:}}\";; esac\n",
      find_ffmpeg().value().string());
  const std::string trouble = "Error writing trailer of film: No space left on device";
  for (const auto& [script, message] :
       {std::pair("cat > /dev/null\necho '" + trouble + "' >&2\nexit 0\n", "ffmpeg failed: " + trouble),
        {"cat > /dev/null\nexit 0\n", "its film has 0 frames of"},
        {cut, "ffmpeg failed: "}}) {
    fake(script);
    const Outcome outcome = command(
        "PATH=\"$PWD/bin:$PATH\" $P video $S/pendulum.gltf --duration 0.2 --size 320x180 --output a.mp4");
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr(message));
    EXPECT_EQ(content("a.mp4"), "an earlier film");
    EXPECT_EQ(files(), (std::vector<std::string>{"a.mp4", "bin", "bin/ffmpeg"}));
  }
}

TEST_F(FilmFiles, KillsStalledFfmpeg) {
  fake("exec sleep 60\n");
  const fs::path program = folder() / "bin/ffmpeg";
  const auto start = std::chrono::steady_clock::now();
  const std::string message = "ffmpeg has done nothing for 0.2 s";
  Ffmpeg deaf(program, {}, {}, std::chrono::milliseconds(200));
  const std::vector<std::uint8_t> more_than_a_pipe_holds(1 << 20);
  EXPECT_THAT(test::message_of([&] { deaf.write(more_than_a_pipe_holds); }), HasSubstr(message));
  Ffmpeg endless(program, {}, {}, std::chrono::milliseconds(200));
  EXPECT_THAT(test::message_of([&] { endless.finish(); }), HasSubstr(message));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(FrameClock, PutsFramesBetweenSteps) {
  const std::vector<FrameClock> clocks = frame_clocks({0.1, 0.12, 0.14}, 0.02, {1.0 / 60, 1.0 / 240});
  // Frames at 0.1, 0.12, 0.14: steps 6, 7.2 and 8.4.
  EXPECT_EQ(clocks[0].steps, (std::vector<std::int64_t>{6, 7, 8, 9}));
  EXPECT_EQ(clocks[1].steps, (std::vector<std::int64_t>{24, 28, 32, 36}));
  ASSERT_EQ(clocks[0].positions.size(), 3u);
  EXPECT_EQ(clocks[0].positions[1].before, 1u);
  EXPECT_NEAR(clocks[0].positions[1].weight, 0.2, 1e-9);
  EXPECT_EQ(clocks[0].frames_of(4), 3u);
  EXPECT_EQ(clocks[0].frames_of(3), 2u);
  EXPECT_THROW(frame_clocks({0, 0.02, 0.04}, 0.02, {1.0 / 60, 1.0 / 90}), Error);
  EXPECT_EQ(frame_clocks({0, 1.0 / 30}, 1.0 / 30, {1.0 / 60, 1.0 / 90})[1].steps[1], 3);
}

TEST(FilmCamera, HoldsAllRunsButAnExplosion) {
  const Scene loaded = scene_named("pendulum");
  Comparison comparison;
  comparison.times.resize(3);
  comparison.runs.resize(3);
  for (std::size_t run = 0; run < 3; ++run) {
    for (const double way : {0.0, 0.1, run == 0 ? 0.2 : run == 1 ? 0.9 : 100.0}) {
      comparison.runs[run].poses.push_back(initial_state(loaded).q);
      comparison.runs[run].poses.back()[1].linear.x() += way * size_of(loaded);
    }
  }
  EXPECT_EQ(seen_frames(loaded, comparison).size(), 1u + 3 + 3 + 2);
}

TEST(FilmCamera, StaysNearAFollowedBody) {
  const auto first_frame = [](double speed) {
    Scene loaded = scene_named("tumbling_body");
    loaded.bodies[1].linear_velocity = {speed, 0, 0};
    VideoSettings film;
    film.comparison.step = loaded.step;
    film.comparison.duration = 0.2;
    film.comparison.has_reference = false;
    film.comparison.panels.resize(1);
    film.camera = camera_named("follow:" + loaded.bodies[1].name, loaded);
    const Comparison comparison = simulate_comparison(loaded, film.comparison);
    Image first;
    paint_frames(film_of(loaded, film, comparison), 320, 180, 6, [&](int k, const Image& frame) {
      if (k == 0) first = frame;
    });
    return first;
  };
  EXPECT_EQ(first_frame(0).rgb, first_frame(50).rgb);
}

TEST(FilmCamera, TakesNameOfNodeOrCamera) {
  Scene loaded = scene_named("pendulum");
  Camera side = *loaded.camera;
  side.pose.position = {7, 0, 0};
  loaded.cameras.push_back({"on the left", "wide", side});
  for (const char* const name : {"name:on the left", "name:wide"})
    EXPECT_EQ(seen_by(camera_named(name, loaded), loaded).camera->pose.position.x(), 7) << name;
  EXPECT_EQ(seen_by(camera_named("scene", loaded), loaded).camera->pose.position,
            loaded.camera->pose.position);
  EXPECT_FALSE(seen_by(camera_named("fit", loaded), loaded).camera);
}

TEST(FilmCamera, FollowsABodyAndOrbitsTheScene) {
  const Scene loaded = scene_named("rod_chain");
  const View view = view_from(*loaded.camera, 16.0 / 9);
  const FilmCamera follow = camera_named("follow:" + loaded.bodies[2].name, loaded);
  EXPECT_EQ(follow.follows, 2);
  const View along = moved(view, follow, {1, 2, 3}, 1, Vector3::Zero());
  EXPECT_NEAR((along.eye - view.eye).y, 2, 1e-12);
  // After half a turn the camera is on the other side of the middle, and looks back.
  const View round = moved(view, camera_named("orbit:90", loaded), Vector3::Zero(), 2, {0.5, 0, 0.25});
  EXPECT_NEAR(round.eye.x, 1 - view.eye.x, 1e-12);
  EXPECT_NEAR(round.eye.y, view.eye.y, 1e-12);
  EXPECT_NEAR(round.eye.z, 0.5 - view.eye.z, 1e-12);
  EXPECT_NEAR(round.forward.x, -view.forward.x, 1e-12);
  for (const char* const text : {"follow:nobody", "orbit:round", "somewhere", "name:nobody"})
    EXPECT_THROW(camera_named(text, loaded), Error) << text;
}

}  // namespace
}  // namespace substep::render
