/// Ten faults, five in the simulation and five in the renderer, and whether each is put down to the right
/// one, to the right body and to the right frame. What a fault gives is made the golden, so that the shipped
/// program is what differs from it and needs no switch to be faulty. And a set that must fail whatever the
/// renderer: beyond every tolerance, not only unequal.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "golden/check/case_pictures.h"
#include "golden/compare/track.h"
#include "render/renderer.h"
#include "sim/algorithms.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "tests/golden/small_suite.h"

namespace substep {
namespace {

constexpr int last_frame = 40;

int body_named(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].name == name) return static_cast<int>(i);
  }
  throw std::runtime_error("no body " + name);
}

Body& body(Scene& scene, const std::string& name) {
  return scene.bodies[static_cast<std::size_t>(body_named(scene, name))];
}

/// A case whose golden run is made by a faulty simulation, and where that run truly comes apart from the
/// right one: found by comparing all states, without any of what is tested.
class SimulationFault {
 public:
  explicit SimulationFault(const std::string& scene_name) : suite_(scene_name, last_frame) {
    suite_.make_goldens();
    settings_ = read_suite(suite_.options.suite).cases.at(0).settings;
  }

  CaseResult check_with(const std::function<void(Scene&)>& fault, const Procedure& procedure = {}) {
    const Scene right = load_scene(suite_.scene());
    Scene faulty = right;
    fault(faulty);
    settings_.step = right.step;
    Simulation good(right, settings_);
    Simulation bad = procedure ? Simulation(faulty, settings_, procedure) : Simulation(faulty, settings_);
    Tracker tracker(faulty, settings_);
    const auto compare_states = [&](int frame) {
      tracker.add(bad.state());
      for (std::size_t i = 1; i < right.bodies.size(); ++i) {
        const auto same = [&](const auto& a, const auto& b) { return a == b; };
        const bool is_same = same(good.state().q[i].linear, bad.state().q[i].linear) &&
                             good.state().q[i].angular.coeffs() == bad.state().q[i].angular.coeffs() &&
                             same(good.state().v[i].linear, bad.state().v[i].linear) &&
                             same(good.state().v[i].angular, bad.state().v[i].angular);
        if (is_same || (true_frame >= 0 && frame != true_frame)) continue;
        true_frame = frame;
        true_bodies.push_back(right.bodies[i].name);
      }
    };
    compare_states(0);
    const PoseLog log = record(bad, last_frame, 10, [&](int frame, const StepReport&) {
      good.step();
      compare_states(frame);
    });
    write_file(suite_.poses(), to_text(log));
    write_file(suite_.track(), to_bytes(tracker.take()));
    // The golden pictures of that run, by the right renderer.
    CasePainter painter(right, read_suite(suite_.options.suite).cases.at(0), log);
    for (const int frame : {10, last_frame}) {
      write_png(painter.draw_picture(log.frames[static_cast<std::size_t>(frame)].poses), suite_.image(frame));
    }
    const CaseResult result = suite_.run().cases.at(0);
    EXPECT_EQ(result.verdict, Verdict::simulation_changed) << explain(result, suite_.options);
    EXPECT_EQ(result.poses.motion.first.frame, true_frame);
    EXPECT_EQ(result.poses.motion.first.bodies, true_bodies);
    return result;
  }

  int true_frame = -1;
  std::vector<std::string> true_bodies;

 private:
  SmallSuite suite_;
  Settings settings_;
};

TEST(SimulationFault, StartOfABody) {
  SimulationFault fault("bouncing_balls");
  const auto result = fault.check_with([](Scene& scene) { body(scene, "ball_2").pose.position.x() += 1e-3; });
  const FirstChange& first = result.poses.motion.first;
  EXPECT_EQ(first.frame, 0);
  EXPECT_EQ(first.body, "ball_2");
  EXPECT_EQ(first.axis, 'x');
  EXPECT_NEAR(first.size, 1e-3, 1e-12);
}

TEST(SimulationFault, SignOfGravityForABody) {
  SimulationFault fault("bouncing_balls");
  const auto result = fault.check_with([](Scene& scene) { body(scene, "ball_3").gravity_factor = -1; });
  const FirstChange& first = result.poses.motion.first;
  EXPECT_EQ(first.frame, 1);
  EXPECT_EQ(first.body, "ball_3");
  EXPECT_EQ(first.axis, 'y');
  // It is drawn at another height long before half a second, and some frame is the first to show it.
  EXPECT_GT(result.poses.motion.predicted_frame, 1);
  EXPECT_LT(result.poses.motion.predicted_frame, 20);
  EXPECT_EQ(result.poses.motion.predicted_body, "ball_3");
  EXPECT_TRUE(result.poses.visible_is_fact);
  EXPECT_GE(result.poses.visible_frame, 1);
  EXPECT_LE(result.poses.visible_frame, result.poses.motion.predicted_frame);
}

TEST(SimulationFault, LostContact) {
  SimulationFault fault("bouncing_balls");
  const auto result = fault.check_with([](Scene& scene) {
    const int ball = body_named(scene, "ball_4");
    for (Collider& collider : scene.colliders) {
      if (collider.body == ball) collider.in_no_system = false, collider.member = collider.collides_with = 0;
    }
  });
  EXPECT_EQ(result.poses.motion.first.body, "ball_4");
  EXPECT_GT(result.poses.motion.first.frame, 5);  // it falls first
}

TEST(SimulationFault, SignOfAVelocityInTheSolver) {
  SimulationFault fault("bouncing_balls");
  int step = 0;
  const auto result = fault.check_with([](Scene&) {},
                                       [&](std::vector<Coordinates>& q, std::vector<Velocity>& v,
                                           const Settings& settings, Problem& problem, Work& work) {
                                         const std::vector<Coordinates> before = q;
                                         proc3(q, v, settings, problem, work);
                                         if (++step != 7) return;
                                         q[2].linear.y() = 2 * before[2].linear.y() - q[2].linear.y();
                                         v[2].linear.y() = -v[2].linear.y();
                                       });
  EXPECT_EQ(result.poses.motion.first.frame, 7);
  EXPECT_EQ(result.poses.motion.first.bodies.size(), 1U);
}

TEST(SimulationFault, Inertia) {
  SimulationFault fault("tumbling_body");
  const auto result =
      fault.check_with([](Scene& scene) { body(scene, "handle").inverse_inertia.y() *= 1.01; });
  EXPECT_EQ(result.poses.motion.first.frame, 1);
  EXPECT_EQ(result.poses.motion.first.body, "handle");
}

/// A case whose golden picture of the last frame is drawn of a faulty scene.
class RendererFault {
 public:
  RendererFault() : suite_("bouncing_balls", last_frame) { suite_.make_goldens(); }

  PicturePair check_with(const std::function<void(Scene&)>& fault) {
    Scene faulty = load_scene(suite_.scene());
    fault(faulty);
    const SuiteCase entry = read_suite(suite_.options.suite).cases.at(0);
    const PoseLog log = read_pose_log(suite_.poses());
    CasePainter painter(faulty, entry, log);
    write_png(painter.draw_picture(log.frames.back().poses), suite_.image(last_frame));
    const CaseResult result = suite_.run().cases.at(0);
    EXPECT_EQ(result.verdict, Verdict::renderer_changed) << explain(result, suite_.options);
    EXPECT_TRUE(result.poses.passes);
    EXPECT_EQ(result.pairs.size(), 1U);
    EXPECT_EQ(result.pairs.at(0).frame, last_frame);
    EXPECT_EQ(result.pairs.at(0).about, PicturePair::About::renderer);
    return result.pairs.at(0);
  }

  /// The fault is in one body: more of the difference is its own than all others' (whose shadows change a
  /// little, for what casts them changed).
  void expect_blame(const std::string& name, const std::function<void(Scene&, int)>& fault) {
    const PicturePair pair = check_with([&](Scene& scene) { fault(scene, body_named(scene, name)); });
    ASSERT_TRUE(pair.comparison.blame);
    EXPECT_FALSE(pair.comparison.blame->is_everywhere);
    std::int64_t own = 0;
    std::int64_t others = 0;
    for (const BodyBlame& found : pair.comparison.blame->bodies) {
      if (found.body > 0) (found.name == name ? own : others) += found.levels;
    }
    EXPECT_GT(own, others);
  }

 private:
  SmallSuite suite_;
};

/// A mesh of the body's own, for the others may share it.
Mesh& own_mesh(Scene& scene, int body) {
  for (Visual& visual : scene.visuals) {
    if (visual.body != body) continue;
    scene.meshes.push_back(scene.meshes[static_cast<std::size_t>(visual.mesh)]);
    visual.mesh = static_cast<int>(scene.meshes.size()) - 1;
    return scene.meshes.back();
  }
  throw std::runtime_error("the body has no mesh");
}

TEST(RendererFault, Light) {
  RendererFault fault;
  const PicturePair pair = fault.check_with([](Scene& scene) { scene.sun->direction.x() += 0.4; });
  EXPECT_TRUE(pair.comparison.blame->is_everywhere);
}

TEST(RendererFault, FieldOfView) {
  RendererFault fault;
  const PicturePair pair =
      fault.check_with([](Scene& scene) { scene.camera->vertical_field_of_view *= 0.95; });
  EXPECT_TRUE(pair.comparison.blame->is_everywhere);
}

TEST(RendererFault, MaterialOfABody) {
  RendererFault fault;
  fault.expect_blame("ball_1", [](Scene& scene, int ball) {
    Surface other = scene.surfaces.front();
    other.base_color = {0.1, 0.2, 0.7};
    scene.surfaces.push_back(other);
    own_mesh(scene, ball).surface = static_cast<int>(scene.surfaces.size()) - 1;
  });
}

TEST(RendererFault, MissingMesh) {
  RendererFault fault;
  fault.expect_blame("ball_3", [](Scene& scene, int ball) {
    std::erase_if(scene.visuals, [&](const Visual& visual) { return visual.body == ball; });
    std::erase_if(scene.colliders, [&](const Collider& collider) { return collider.body == ball; });
  });
}

TEST(RendererFault, SizeOfAMesh) {
  RendererFault fault;
  fault.expect_blame("ball_4", [](Scene& scene, int ball) {
    for (Vector3& position : own_mesh(scene, ball).positions) position *= 1.4;
  });
}

/// A case whose golden picture of the last frame is not what is drawn now.
class MustFail : public testing::Test {
 protected:
  MustFail() : suite_("bouncing_balls", last_frame) { suite_.make_goldens(); }

  Image golden() const { return read_png(suite_.image(last_frame)); }

  /// As a fault would draw the golden poses.
  Image drawn(const std::function<void(Scene&, std::vector<Coordinates>&)>& fault) const {
    Scene scene = load_scene(suite_.scene());
    const PoseLog log = read_pose_log(suite_.poses());
    std::vector<Coordinates> poses = log.frames.back().poses;
    fault(scene, poses);
    CasePainter painter(scene, read_suite(suite_.options.suite).cases.at(0), log);
    return painter.draw_picture(poses);
  }

  void expect_failure(const Image& picture) {
    write_png(picture, suite_.image(last_frame));
    const CheckResult result = suite_.run();
    EXPECT_EQ(result.exit_code(), 1);
    EXPECT_EQ(result.cases.at(0).verdict, Verdict::renderer_changed);
    const ImageResult& image = result.cases.at(0).images.back();
    EXPECT_FALSE(image.passes);
    EXPECT_FALSE(passes(image.against_golden->image.judgement))
        << name(image.against_golden->image.judgement);
    EXPECT_EQ(image.against_golden->flip->visibility, "visible");
  }

  SmallSuite suite_;
};

TEST_F(MustFail, MovedBody) {
  expect_failure(drawn([](Scene& scene, std::vector<Coordinates>& poses) {
    poses[static_cast<std::size_t>(body_named(scene, "ball_2"))].linear.x() += 0.1;
  }));
}

TEST_F(MustFail, MissingBody) {
  expect_failure(drawn([](Scene& scene, std::vector<Coordinates>&) {
    const int ball = body_named(scene, "ball_1");
    std::erase_if(scene.visuals, [&](const Visual& visual) { return visual.body == ball; });
    std::erase_if(scene.colliders, [&](const Collider& collider) { return collider.body == ball; });
  }));
}

TEST_F(MustFail, Hue) {
  // The same mesh in a colour of about the same luminance: grey pictures would hardly differ.
  expect_failure(drawn([](Scene& scene, std::vector<Coordinates>&) {
    Mesh& mesh = own_mesh(scene, body_named(scene, "ball_2"));
    Surface other = scene.surfaces[static_cast<std::size_t>(mesh.surface)];
    std::swap(other.base_color[0], other.base_color[1]);
    scene.surfaces.push_back(other);
    mesh.surface = static_cast<int>(scene.surfaces.size()) - 1;
  }));
}

TEST_F(MustFail, SwappedPanels) {
  const Image before = golden();
  Image swapped = before;
  const int half = before.width / 2;
  for (int y = 0; y < before.height; ++y) {
    std::copy_n(before.pixel(half, y), 3 * half, swapped.pixel(0, y));
    std::copy_n(before.pixel(0, y), 3 * half, swapped.pixel(half, y));
  }
  expect_failure(swapped);
}

TEST_F(MustFail, ShiftedLight) {
  expect_failure(drawn([](Scene& scene, std::vector<Coordinates>&) { scene.sun->direction.x() += 0.3; }));
}

TEST_F(MustFail, BlackGolden) {
  expect_failure(Image(160, 90));
}

TEST(MustFailInTheSolver, OneSign) {
  SimulationFault fault("box_stack");
  const auto result = fault.check_with([](Scene&) {},
                                       [](std::vector<Coordinates>& q, std::vector<Velocity>& v,
                                          const Settings& settings, Problem& problem, Work& work) {
                                         const double before = v[1].angular.z();
                                         proc3(q, v, settings, problem, work);
                                         v[1].angular.z() = 2 * before - v[1].angular.z();
                                       });
  EXPECT_FALSE(passes(result.poses.motion.judgement));
}

/// Puts `value` between every `start` and the `end` after it.
void replace_values(std::string& text, const std::string& start, char end, const std::string& value) {
  for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at)) {
    at += start.size();
    text.replace(at, text.find(end, at) - at, value);
  }
}

/// A scene that is drawn black: metal that reflects nothing, seen from so near that nothing else is.
class BlackFrame : public testing::Test {
 protected:
  BlackFrame() {
    std::string text = read_text(suite_.scene());
    replace_values(text, "\"baseColorFactor\":[", ']', "0,0,0,1");
    replace_values(text, "\"metallicFactor\":", ',', "1.0");
    write_text(suite_.scene(), text);
    replace_in(suite_.scene(), "\"translation\":[9.0,9.4,16.6]", "\"translation\":[0,5.5,3]");
    replace_in(suite_.scene(),
               "\"rotation\":[-0.11793651712559072,0.24403200422826324,0.029913895231727477,"
               "0.9621042135406577]",
               "\"rotation\":[0,0,0,1]");
    replace_in(suite_.scene(), "\"yfov\":0.6", "\"yfov\":0.02");
  }

  SmallSuite suite_;
};

TEST_F(BlackFrame, IsNotApproved) {
  const CaseResult result = suite_.run().cases.at(0);
  EXPECT_EQ(result.verdict, Verdict::created);
  const Image black = read_png(suite_.shown("f0020.new.png"));
  EXPECT_LE(*std::max_element(black.rgb.begin(), black.rgb.end()), 2);
  try {
    suite_.approve_failed();
    FAIL() << "was approved";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("frame 10 is blank"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(std::filesystem::exists(suite_.image(20)));
  EXPECT_FALSE(std::filesystem::exists(suite_.poses()));
}

TEST_F(BlackFrame, FailsACheckEvenWhereTheGoldenIsBlackToo) {
  suite_.run();
  write_text(suite_.poses(), read_text(suite_.shown("actual.poses")));
  write_text(suite_.track(), read_text(suite_.shown("actual.track")));
  write_text(suite_.image(10), read_text(suite_.shown("f0010.new.png")));
  write_text(suite_.image(20), read_text(suite_.shown("f0020.new.png")));
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.exit_code(), 1);
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::renderer_changed);
  EXPECT_EQ(result.cases.at(0).images.at(0).against_golden->image.judgement, Judgement::exact);
  EXPECT_NE(explain(result.cases.at(0), suite_.options).find("the picture is blank"), std::string::npos);
}

}  // namespace
}  // namespace substep

int main(int argc, char** argv) {
  substep::pin_renderer();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
