/// Tests that faults in simulation, renderer and loading are attributed to the right one, body and frame. A
/// faulty run becomes the golden, so that the shipped program differs from it and needs no switch for faults.
/// Some faults must fail on every renderer: their pictures are beyond every tolerance, not only unequal.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <regex>
#include <string>
#include <utility>

#include "render/renderer.h"
#include "sim/algorithms.h"
#include "sim/loading/load_scene.h"
#include "tests/error_message.h"
#include "tests/golden/small_suite.h"
#include "tests/scene_files.h"

namespace substep::golden {
namespace {

constexpr int last_frame = 40;

Body& body(Scene& scene, const std::string& name) {
  return scene.bodies[static_cast<std::size_t>(body_named(scene, name))];
}

/// Writes a run as the goldens of a suite, with pictures of a scene.
void write_run(const SmallSuite& suite, const PoseLog& log, const Track& track, const Scene& drawn) {
  write_text(suite.poses(), to_text(log));
  write_text(suite.track(), to_bytes(track));
  CasePainter painter(drawn, suite.entry(), log);
  for (const int frame : suite.entry().images) {
    const std::vector<Coordinates>& poses = log.frames[static_cast<std::size_t>(frame)].poses;
    write_text(suite.image(frame), render::to_png(painter.draw(poses).picture));
  }
}

/// The true divergence of a faulty run from the right one: found by comparing all states, without the code
/// under test.
struct TrueDivergence {
  void add(const Scene& scene, const State& right, const State& faulty) {
    const int now = static_cast<int>(distances.size());
    std::vector<double>& apart = distances.emplace_back();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const auto& [q, q_faulty] = std::pair(right.q[i], faulty.q[i]);
      const auto& [v, v_faulty] = std::pair(right.v[i], faulty.v[i]);
      apart.push_back((q.linear - q_faulty.linear).cwiseAbs().maxCoeff());
      const bool is_same = q.linear == q_faulty.linear && q.angular.coeffs() == q_faulty.angular.coeffs() &&
                           v.linear == v_faulty.linear && v.angular == v_faulty.angular;
      if (is_same || (frame >= 0 && frame != now)) continue;
      frame = now;
      bodies.push_back(scene.bodies[i].name);
    }
  }

  int frame = -1;                              ///< first with another state
  std::vector<std::string> bodies;             ///< those with another state in it
  std::vector<std::vector<double>> distances;  ///< m, by frame and body
};

/// Expects the reported body to be the farthest off of those that changed first, and its distance to be the
/// reported one, within the rounding of both poses.
void expect_true_size(const FirstChange& first, const TrueDivergence& truth, const Scene& scene) {
  ASSERT_GE(first.size_frame, truth.frame);
  if (first.axis == 'r' || first.axis == ' ') return;
  const auto apart = [&](const std::string& name) {
    return truth.distances.at(static_cast<std::size_t>(first.size_frame))
        .at(static_cast<std::size_t>(body_named(scene, name)));
  };
  const bool is_rounded = first.size_frame % 10 != 0;
  const double error = is_rounded ? 1.01 * Track::resolution : 1e-12;
  EXPECT_NEAR(first.size, apart(first.body), error);
  for (const std::string& name : truth.bodies) EXPECT_LE(apart(name), first.size + error) << name;
}

/// Returns A3 whose result `change` alters. `change` receives the step's number and the state before the
/// step.
Procedure altered(const std::function<void(int step, const State& before, CoordinateVector& q,
                                           VelocityVector& v)>& change) {
  return [change, step = 0](CoordinateVector& q, VelocityVector& v, const Settings& settings,
                            Problem& problem, Work& work) mutable {
    State before;
    before.q = q;
    before.v = v;
    proc3(q, v, settings, problem, work);
    change(++step, before, q, v);
  };
}

/// The frames in which a fault may show first, and the expected body and axis of its first difference.
struct Expected {
  int earliest;
  int latest;
  const char* body = "";  ///< empty: any
  char axis = 0;          ///< 0: any
  Verdict verdict = Verdict::simulation_changed;
};

/// A fault of the procedure or, without one, of the model.
struct Fault {
  const char* name;
  const char* scene;
  Expected expected;
  std::function<void(Scene&)> of_model;
  Procedure of_procedure;
};

void PrintTo(const Fault& fault, std::ostream* out) {
  *out << fault.name;
}

std::vector<Fault> faults() {
  std::vector<Fault> all;
  const auto model = [&](const char* name, const char* scene, const Expected& expected,
                         const std::function<void(Scene&)>& change) {
    all.push_back({name, scene, expected, change, {}});
  };
  const auto procedure = [&](const char* name, const char* scene, const Expected& expected,
                             const Procedure& faulty) {
    all.push_back({name, scene, expected, [](Scene&) {}, faulty});
  };
  model("StartOfABody", "bouncing_balls", {0, 0, "ball_2", 'x', Verdict::loading_changed},
        [](Scene& scene) { body(scene, "ball_2").pose.position.x() += 1e-3; });
  model("SignOfGravityForABody", "bouncing_balls", {1, 1, "ball_3", 'y'},
        [](Scene& scene) { body(scene, "ball_3").gravity_factor = -1; });
  // Allow for the ball's fall.
  model("LostContact", "bouncing_balls", {6, 40, "ball_4"}, [](Scene& scene) {
    for (Collider& collider : scene.colliders) {
      if (collider.body != body_named(scene, "ball_4")) continue;
      collider.in_no_system = false;
      collider.member = collider.collides_with = 0;
    }
  });
  model("Inertia", "tumbling_body", {1, 1, "handle"},
        [](Scene& scene) { body(scene, "handle").inverse_inertia.y() *= 1.01; });
  model("GravityOnePercentStronger", "box_stack", {1, 1}, [](Scene& scene) { scene.gravity *= 1.01; });
  model("FrictionATenthLess", "incline", {1, 40}, [](Scene& scene) {
    for (Collider& collider : scene.colliders) {
      collider.material.dynamic_friction *= 0.9;
      collider.material.static_friction *= 0.9;
    }
  });
  procedure("SignOfAVelocity", "bouncing_balls", {7, 7},
            altered([](int step, const State& before, CoordinateVector& q, VelocityVector& v) {
              if (step != 7) return;
              q[2].linear.y() = 2 * before.q[2].linear.y() - q[2].linear.y();
              v[2].linear.y() = -v[2].linear.y();
            }));
  procedure("VelocitiesFadeFromAStepOn", "tumbling_body", {21, 21},
            altered([](int step, const State&, CoordinateVector&, VelocityVector& v) {
              if (step > 20) v[1].angular *= 0.999;
            }));
  // Move one of two bodies by less than the rounding of the track's poses.
  procedure("DisplacementBelowRounding", "box_stack", {3, 3, "box_10"},
            altered([](int step, const State&, CoordinateVector& q, VelocityVector&) {
              if (step == 3) q[10].linear.y() += 2.8e-6;
            }));
  return all;
}

class EachSimulationFault : public testing::TestWithParam<Fault> {};

TEST_P(EachSimulationFault, IsFoundInItsFrame) {
  const Expected& expected = GetParam().expected;
  SmallSuite suite(GetParam().scene, last_frame);
  suite.make_goldens();
  const Scene right = load_scene(suite.scene());
  Scene faulty = right;
  GetParam().of_model(faulty);
  const Procedure& procedure = GetParam().of_procedure;
  Settings settings = suite.entry().settings;
  settings.step = right.step;
  Simulation good(right, settings);
  Simulation bad = procedure ? Simulation(faulty, settings, procedure) : Simulation(faulty, settings);
  Tracker tracker(faulty, settings);
  TrueDivergence truth;
  const auto add_states = [&] {
    tracker.add(bad.state());
    truth.add(right, good.state(), bad.state());
  };
  add_states();
  const PoseLog log = record(bad, last_frame, 10, [&](int, const StepReport&) {
    good.step();
    add_states();
  });
  // Draw the golden pictures of the faulty run with the right renderer.
  write_run(suite, log, tracker.take(), right);
  suite.sign();
  const CheckResult result = suite.run();
  EXPECT_EQ(result.verdict, expected.verdict) << result.text;
  const FirstChange& first = result.poses.motion.first;
  if (expected.verdict == Verdict::simulation_changed) {
    EXPECT_EQ(result.cause, fmt::format("from frame {} on, {}", truth.frame, first.body));
  }
  EXPECT_EQ(first.frame, truth.frame);
  EXPECT_EQ(first.bodies, truth.bodies);
  expect_true_size(first, truth, right);
  EXPECT_GE(first.frame, expected.earliest);
  EXPECT_LE(first.frame, expected.latest);
  EXPECT_TRUE(*expected.body == '\0' || first.body == expected.body) << first.body;
  EXPECT_TRUE(expected.axis == 0 || first.axis == expected.axis) << first.axis;
  EXPECT_FALSE(passes(result.poses.motion.judgement));
  if (std::string(GetParam().name) != "SignOfGravityForABody") return;
  // The ball is drawn at another height long before half a second, and some frame is the first to show it.
  EXPECT_TRUE(result.poses.visible_frame_is_certain);
  EXPECT_GE(result.poses.visible_frame, 1);
  EXPECT_LT(result.poses.visible_frame, 20);
}

INSTANTIATE_TEST_SUITE_P(Faults, EachSimulationFault, testing::ValuesIn(faults()),
                         [](const auto& fault) { return std::string(fault.param.name); });

/// Writes the sidecar for a suite's poses, track and pictures, with the digests of `scene`.
void write_sidecar(const SmallSuite& suite, const Scene& scene) {
  std::vector<Sidecar::Picture> pictures;
  for (const int frame : suite.entry().images)
    pictures.push_back({frame, hash_text(hash(render::read_png(suite.image(frame)))), {}});
  const std::string track_hash = content_hash(read_bytes(suite.track()));
  write_text(suite.sidecar(), sidecar_text(make_sidecar(suite.entry(), read_pose_log(suite.poses()),
                                                        track_hash, scene, pictures, MadeWith())));
}

TEST(LoadingFault, BlamesIgnoredCentreOfMass) {
  // A faulty loader makes all goldens: it takes another point for the body's centre of mass.
  SmallSuite suite("tumbling_body", last_frame);
  suite.make_goldens();
  Scene faulty = load_scene(suite.scene());
  const int handle = body_named(faulty, "handle");
  const Vector3 shift(0.02, 0, 0);
  body(faulty, "handle").pose.position = body(faulty, "handle").pose * shift;
  body(faulty, "handle").body_from_node.position -= shift;
  for (Collider& collider : faulty.colliders) {
    if (collider.body == handle) collider.placement.position -= shift;
  }
  for (Visual& visual : faulty.visuals) {
    if (visual.body == handle) visual.translation -= shift;
  }
  Settings settings = suite.entry().settings;
  settings.step = faulty.step;
  Simulation simulation(faulty, settings);
  Tracker tracker(faulty, settings);
  tracker.add(simulation.state());
  const PoseLog log =
      record(simulation, last_frame, 10, [&](int, const StepReport&) { tracker.add(simulation.state()); });
  write_run(suite, log, tracker.take(), faulty);
  write_sidecar(suite, faulty);
  // Poses and pictures both differ, but neither simulation nor renderer changed.
  const CheckResult result = suite.run();
  EXPECT_FALSE(result.poses.passes);
  EXPECT_FALSE(result.images.back().passes);
  EXPECT_EQ(result.verdict, Verdict::loading_changed) << result.text;
  EXPECT_EQ(result.cause.find("initial pose or velocity of handle"), 0U) << result.cause;
}

/// A case whose golden picture of the last frame shows a faulty scene.
class RendererFault {
 public:
  RendererFault() : suite_("bouncing_balls", last_frame) { suite_.make_goldens(); }

  /// The scene, poses and settings that the renderer draws; a fault changes them.
  struct Drawn {
    Scene scene;
    std::vector<Coordinates> poses;
    render::RenderSettings settings;
  };

  PicturePair check_with(const std::function<void(Drawn&)>& fault) {
    const SuiteCase entry = suite_.entry();
    const PoseLog log = read_pose_log(suite_.poses());
    Drawn drawn{
        load_scene(suite_.scene()), log.frames.back().poses, {.width = entry.width, .height = entry.height}};
    fault(drawn);
    render::Renderer renderer(drawn.scene, drawn.settings, full_frames(log, drawn.scene));
    return check_picture(renderer.draw(drawn.poses));
  }

  render::Image golden() const { return render::read_png(suite_.image(last_frame)); }

  PicturePair check_picture(const render::Image& picture) {
    render::write_png(picture, suite_.image(last_frame));
    suite_.sign();
    const CheckResult result = suite_.run();
    EXPECT_EQ(result.verdict, Verdict::renderer_changed) << result.text;
    EXPECT_TRUE(result.poses.passes);
    EXPECT_EQ(result.pairs.size(), 1U);
    EXPECT_EQ(result.pairs.at(0).frame, last_frame);
    EXPECT_EQ(result.pairs.at(0).about, PicturePair::About::renderer);
    cause = result.cause;
    return result.pairs.at(0);
  }

  /// Expects most of the difference in one body; the shadows of others may change a little.
  PicturePair expect_blame(const std::string& name, const std::function<void(Scene&, int)>& fault) {
    const PicturePair pair =
        check_with([&](Drawn& drawn) { fault(drawn.scene, body_named(drawn.scene, name)); });
    EXPECT_FALSE(pair.comparison.blame.value().is_everywhere);
    std::int64_t own = 0;
    std::int64_t others = 0;
    for (const BodyBlame& found : pair.comparison.blame->bodies) {
      if (found.body > 0) (found.name == name ? own : others) += found.levels;
    }
    EXPECT_GT(own, others);
    return pair;
  }

  std::string cause;

 private:
  SmallSuite suite_;
};

/// Gives the body its own copy of its mesh, which others may share, and returns it.
Mesh& own_mesh(Scene& scene, int body) {
  for (Visual& visual : scene.visuals) {
    if (visual.body != body) continue;
    scene.meshes.push_back(scene.meshes[static_cast<std::size_t>(visual.mesh)]);
    visual.mesh = static_cast<int>(scene.meshes.size()) - 1;
    return scene.meshes.back();
  }
  throw std::runtime_error("the body has no mesh");
}

/// Gives the body its own copy of its surface and returns it.
Surface& own_surface(Scene& scene, int body) {
  Mesh& mesh = own_mesh(scene, body);
  scene.surfaces.push_back(scene.surfaces[static_cast<std::size_t>(std::max(mesh.surface, 0))]);
  mesh.surface = static_cast<int>(scene.surfaces.size()) - 1;
  return scene.surfaces.back();
}

void remove_from_picture(Scene& scene, const std::string& name) {
  const int body = body_named(scene, name);
  std::erase_if(scene.visuals, [&](const Visual& visual) { return visual.body == body; });
  std::erase_if(scene.colliders, [&](const Collider& collider) { return collider.body == body; });
}

/// Expects a failure on any renderer: a difference that is visible and beyond the tolerance.
void expect_beyond_tolerance(const PicturePair& pair) {
  EXPECT_FALSE(passes(pair.comparison.image.judgement)) << name(pair.comparison.image.judgement);
  EXPECT_EQ(visibility(*pair.comparison.flip), "visible");
}

TEST(RendererFault, BlamesNoBodyForLightOrCamera) {
  RendererFault fault;
  const auto expect_everywhere = [&](void (*change)(Scene&)) {
    const PicturePair pair = fault.check_with([&](RendererFault::Drawn& drawn) { change(drawn.scene); });
    EXPECT_TRUE(pair.comparison.blame->is_everywhere);
    EXPECT_EQ(fault.cause, "light, camera or sky");
    return pair;
  };
  expect_beyond_tolerance(expect_everywhere([](Scene& scene) { scene.sun->direction.x() += 0.3; }));
  expect_everywhere([](Scene& scene) { scene.sun->color = {0.8, 0.95, 1}; });
  expect_everywhere([](Scene& scene) { scene.camera->vertical_field_of_view *= 0.95; });
  expect_everywhere([](Scene& scene) {
    scene.camera->pose.orientation *= Quaternion(Eigen::AngleAxisd(0.02, Vector3::UnitX()));
  });
}

TEST(RendererFault, BlamesBodyForItsSurfaceOrMesh) {
  RendererFault fault;
  fault.expect_blame("ball_1", [](Scene& scene, int ball) {
    own_surface(scene, ball).base_color = {0.1, 0.2, 0.7};
  });
  fault.expect_blame("ball_3", [](Scene& scene, int ball) {
    Surface& other = own_surface(scene, ball);
    other.roughness = 0.1;
    other.metallic = 1;
  });
  EXPECT_EQ(fault.cause, "ball_3");
  fault.expect_blame("ball_4", [](Scene& scene, int ball) {
    for (Vector3& position : own_mesh(scene, ball).positions) position *= 1.4;
  });
  fault.expect_blame("ball_2", [](Scene& scene, int ball) {
    for (Vector3& normal : own_mesh(scene, ball).normals) normal = (normal + Vector3(0.5, 0, 0)).normalized();
  });
  EXPECT_EQ(fault.cause, "ball_2");
  expect_beyond_tolerance(
      fault.expect_blame("ball_3", [](Scene& scene, int) { remove_from_picture(scene, "ball_3"); }));
}

TEST(RendererFault, BlamesNoBodyForGammaShadowsOrEdges) {
  RendererFault fault;
  render::Image picture = fault.golden();
  for (std::uint8_t& level : picture.rgb) level = static_cast<std::uint8_t>(level * level / 255);
  fault.check_picture(picture);
  EXPECT_EQ(fault.cause, "light, camera or sky");
  const auto is_everywhere = [&](void (*change)(RendererFault::Drawn&)) {
    return fault.check_with(change).comparison.blame->is_everywhere;
  };
  EXPECT_FALSE(is_everywhere([](RendererFault::Drawn& drawn) { drawn.settings.shadows = false; }));
  EXPECT_EQ(fault.cause, "ground and world");
  EXPECT_FALSE(is_everywhere([](RendererFault::Drawn& drawn) { drawn.settings.antialiasing = false; }));
}

TEST(RendererFault, ReportsMissingBody) {
  // Only the golden picture has the body, which the sidecar of the whole scene lists.
  SmallSuite suite("bouncing_balls", last_frame);
  suite.make_goldens();
  Scene scene = load_scene(suite.scene());
  remove_from_picture(scene, "ball_3");
  const SuiteCase entry = suite.entry();
  const PoseLog log = read_pose_log(suite.poses());
  const Drawing golden{render::read_png(suite.image(last_frame)), {}};
  CasePainter painter(scene, entry, log);
  Drawing drawn = painter.draw(log.frames.back().poses);
  std::vector<std::string> names;
  for (const Body& each : scene.bodies) names.push_back(each.name);
  const Sidecar sidecar = read_sidecar(suite.sidecar());
  const Blame found = blame(golden.picture, drawn.picture, drawn.bodies, drawn.bodies,
                            sidecar.picture(last_frame)->bodies, names);
  EXPECT_FALSE(found.is_everywhere);
  const auto gone = std::find_if(found.bodies.begin(), found.bodies.end(),
                                 [](const BodyBlame& each) { return each.name == "ball_3"; });
  ASSERT_NE(gone, found.bodies.end());
  EXPECT_TRUE(gone->is_gone);
}

TEST(RendererFault, ExceedsToleranceForMotionHueAndBlack) {
  RendererFault fault;
  expect_beyond_tolerance(fault.check_with([](RendererFault::Drawn& drawn) {
    drawn.poses[static_cast<std::size_t>(body_named(drawn.scene, "ball_2"))].linear.x() += 0.1;
  }));
  // Take a colour of about equal luminance: grey pictures would hardly differ.
  expect_beyond_tolerance(fault.check_with([](RendererFault::Drawn& drawn) {
    Surface& other = own_surface(drawn.scene, body_named(drawn.scene, "ball_2"));
    std::swap(other.base_color[0], other.base_color[1]);
  }));
  expect_beyond_tolerance(fault.check_picture(render::Image(160, 90)));
}

/// A scene that is drawn black: metal that reflects nothing fills the picture.
class BlackFrame : public testing::Test {
 protected:
  BlackFrame() {
    std::string text = read_text(suite_.scene());
    text = std::regex_replace(text, std::regex("(\"baseColorFactor\":\\[)[^\\]]*"), "$010,0,0,1");
    text = std::regex_replace(text, std::regex("(\"metallicFactor\":)[^,]*"), "$011.0");
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
  EXPECT_EQ(suite_.run().verdict, Verdict::created);
  const render::Image black = render::read_png(suite_.shown("f0020.new.png"));
  EXPECT_LE(*std::max_element(black.rgb.begin(), black.rgb.end()), 2);
  EXPECT_THAT(test::message_of([&] { suite_.approve_failed(); }), testing::HasSubstr("frame 10 is blank"));
  EXPECT_FALSE(std::filesystem::exists(suite_.image(20)));
  EXPECT_FALSE(std::filesystem::exists(suite_.poses()));
}

TEST_F(BlackFrame, FailsCheckWithBlackGolden) {
  suite_.run();
  const Scene scene = load_scene(suite_.scene());
  write_run(suite_, read_pose_log(suite_.shown("actual.poses")), read_track(suite_.shown("actual.track")),
            scene);
  write_sidecar(suite_, scene);
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.verdict, Verdict::renderer_changed);
  EXPECT_EQ(result.images.at(0).against_golden->image.judgement, Judgement::exact);
  EXPECT_THAT(result.text, testing::HasSubstr("the picture is blank"));
}

}  // namespace
}  // namespace substep::golden
