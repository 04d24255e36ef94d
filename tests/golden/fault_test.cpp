/// Faults in the simulation, in the renderer and in loading, and whether each is put down to the right one,
/// to the right body and to the right frame. What a fault gives is made the golden, so that the shipped
/// program is what differs from it and needs no switch to be faulty. And a set that must fail whatever the
/// renderer: beyond every tolerance, not only unequal.
/// One file, since all faults share a case that is made, broken and judged.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "golden/check/case_pictures.h"
#include "golden/compare/track.h"
#include "render/renderer.h"
#include "sim/algorithms.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "tests/error_message.h"
#include "tests/golden/small_suite.h"
#include "tests/scene_files.h"

namespace substep::golden {
namespace {

constexpr int last_frame = 40;

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

  CaseResult check_with(const std::function<void(Scene&)>& fault, const Procedure& procedure = {},
                        Verdict verdict = Verdict::simulation_changed) {
    const Scene right = load_scene(suite_.scene());
    Scene faulty = right;
    fault(faulty);
    settings_.step = right.step;
    Simulation good(right, settings_);
    Simulation bad = procedure ? Simulation(faulty, settings_, procedure) : Simulation(faulty, settings_);
    Tracker tracker(faulty, settings_);
    const auto compare_states = [&](int frame) {
      tracker.add(bad.state());
      std::vector<double> apart;
      for (std::size_t i = 0; i < right.bodies.size(); ++i) {
        apart.push_back((good.state().q[i].linear - bad.state().q[i].linear).cwiseAbs().maxCoeff());
      }
      apart_.push_back(std::move(apart));
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
      render::write_png(painter.draw_picture(log.frames[static_cast<std::size_t>(frame)].poses),
                        suite_.image(frame));
    }
    suite_.sign();
    const CaseResult result = suite_.run().cases.at(0);
    EXPECT_EQ(result.verdict, verdict) << result.text;
    EXPECT_EQ(result.poses.motion.first.frame, true_frame);
    EXPECT_EQ(result.poses.motion.first.bodies, true_bodies);
    if (verdict == Verdict::simulation_changed) {
      EXPECT_EQ(result.cause,
                fmt::format("from frame {} on, {}", true_frame, result.poses.motion.first.body));
    }
    expect_true_size(result.poses.motion.first, right);
    return result;
  }

  int true_frame = -1;
  std::vector<std::string> true_bodies;

 private:
  /// The body that is named is the one that is farthest off, of those that changed first, and by what is
  /// said: rounded poses are within one step of their rounding on either side.
  void expect_true_size(const FirstChange& first, const Scene& scene) const {
    ASSERT_GE(first.size_frame, true_frame);
    if (first.axis == 'r' || first.axis == ' ') return;
    const std::vector<double>& apart = apart_.at(static_cast<std::size_t>(first.size_frame));
    const bool is_rounded = first.size_frame % 10 != 0;
    const double error = is_rounded ? 1.01 * Track::resolution : 1e-12;
    EXPECT_NEAR(first.size, apart.at(static_cast<std::size_t>(body_named(scene, first.body))), error);
    for (const std::string& name : true_bodies) {
      EXPECT_LE(apart.at(static_cast<std::size_t>(body_named(scene, name))), first.size + error) << name;
    }
  }

  std::vector<std::vector<double>> apart_;  ///< m, by frame and body
  SmallSuite suite_;
  Settings settings_;
};

TEST(SimulationFault, StartOfABody) {
  SimulationFault fault("bouncing_balls");
  const auto result = fault.check_with([](Scene& scene) { body(scene, "ball_2").pose.position.x() += 1e-3; },
                                       {}, Verdict::loading_changed);
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
  EXPECT_TRUE(result.poses.visible_is_fact);
  EXPECT_GE(result.poses.visible_frame, 1);
  EXPECT_LT(result.poses.visible_frame, 20);
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

/// Returns A3 whose result `change` alters. It receives the number of the step and the state before it.
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

/// Returns A3 with settings that `change` alters.
Procedure with_settings(void (*change)(Settings&)) {
  return [change](CoordinateVector& q, VelocityVector& v, const Settings& settings, Problem& problem,
                  Work& work) {
    Settings other = settings;
    change(other);
    proc3(q, v, other, problem, work);
  };
}

/// A fault of the model or, where there is one, of the procedure, and the frames in which it may show first.
/// SimulationFault finds frame and bodies without what is tested.
struct Fault {
  const char* name;
  const char* scene;
  int earliest;
  int latest;
  std::function<void(Scene&)> of_model;
  Procedure of_procedure = {};
  const char* body = "";  ///< that differs first, where it is known beforehand
};

void PrintTo(const Fault& fault, std::ostream* out) {
  *out << fault.name;
}

void none(Scene& /*scene*/) {}

void change_materials(Scene& scene, void (*change)(ContactMaterial&)) {
  for (Collider& collider : scene.colliders) change(collider.material);
}

std::vector<Fault> faults() {
  return {
      {"Inertia",
       "tumbling_body",
       1,
       1,
       [](Scene& scene) { body(scene, "handle").inverse_inertia.y() *= 1.01; },
       {},
       "handle"},
      {"GravityOnePercentStronger", "box_stack", 1, 1, [](Scene& scene) { scene.gravity *= 1.01; }},
      {"NoGyroscopicTerm", "tumbling_body", 1, 1, [](Scene& scene) { scene.gyroscopic = false; }},
      {"FrictionATenthLess", "incline", 1, 40,
       [](Scene& scene) {
         change_materials(scene, [](ContactMaterial& m) {
           m.dynamic_friction *= 0.9;
           m.static_friction *= 0.9;
         });
       }},
      // Balls fall first.
      {"RestitutionsMultiplied", "bouncing_balls", 5, 40,
       [](Scene& scene) {
         change_materials(scene, [](ContactMaterial& m) { m.restitution_combine = Combine::multiply; });
       }},
      {"SignOfAVelocity", "bouncing_balls", 7, 7, none,
       altered([](int step, const State& before, CoordinateVector& q, VelocityVector& v) {
         if (step != 7) return;
         q[2].linear.y() = 2 * before.q[2].linear.y() - q[2].linear.y();
         v[2].linear.y() = -v[2].linear.y();
       })},
      {"MissingSubstep", "box_stack", 1, 1, none, with_settings([](Settings& other) { --other.substeps; })},
      {"VelocitiesFadeFromAStepOn", "tumbling_body", 21, 21, none,
       altered([](int step, const State&, CoordinateVector&, VelocityVector& v) {
         if (step > 20) v[1].angular *= 0.999;
       })},
      {"ForgottenBody", "bouncing_balls", 4, 4, none,
       altered([](int step, const State& before, CoordinateVector& q, VelocityVector&) {
         if (step >= 4) q[3] = before.q[3];
       })},
      // Less than the rounding of the track's poses, in one of two bodies that change.
      {"DisplacementBelowRounding", "box_stack", 3, 3, none,
       altered([](int step, const State&, CoordinateVector& q, VelocityVector&) {
         if (step == 3) q[10].linear.y() += 2.8e-6;
       }),
       "box_10"}};
}

class EachSimulationFault : public testing::TestWithParam<Fault> {};

TEST_P(EachSimulationFault, IsFoundInItsFrame) {
  const Fault& of = GetParam();
  SimulationFault fault(of.scene);
  const CaseResult result = fault.check_with(of.of_model, of.of_procedure);
  const FirstChange& first = result.poses.motion.first;
  EXPECT_GE(first.frame, of.earliest);
  EXPECT_LE(first.frame, of.latest);
  if (*of.body != '\0') {
    EXPECT_EQ(first.body, of.body);
  }
  EXPECT_FALSE(passes(result.poses.motion.judgement));
}

INSTANTIATE_TEST_SUITE_P(Faults, EachSimulationFault, testing::ValuesIn(faults()),
                         [](const auto& fault) { return std::string(fault.param.name); });

/// A case whose goldens are all made by a faulty loader, which noted what it loaded.
CaseResult check_with_loader(const std::string& scene_name, const std::function<void(Scene&)>& fault) {
  SmallSuite suite(scene_name, last_frame);
  suite.make_goldens();
  SuiteCase entry = read_suite(suite.options.suite).cases.at(0);
  Scene faulty = load_scene(suite.scene());
  fault(faulty);
  entry.settings.step = faulty.step;
  Simulation simulation(faulty, entry.settings);
  Tracker tracker(faulty, entry.settings);
  tracker.add(simulation.state());
  const PoseLog log =
      record(simulation, last_frame, 10, [&](int, const StepReport&) { tracker.add(simulation.state()); });
  write_file(suite.poses(), to_text(log));
  write_file(suite.track(), to_bytes(tracker.take()));
  CasePainter painter(faulty, entry, log);
  std::vector<render::Image> pictures;
  for (const int frame : entry.images) {
    pictures.push_back(painter.draw_picture(log.frames[static_cast<std::size_t>(frame)].poses));
    render::write_png(pictures.back(), suite.image(frame));
  }
  std::vector<ApprovablePicture> approved;
  for (const render::Image& picture : pictures) approved.push_back({&picture, {}});
  const ApprovableRun run{&log, content_hash(read_bytes(suite.poses())),
                          content_hash(read_bytes(suite.track()))};
  write_text(suite.sidecar(), sidecar_text(make_sidecar(entry, run, faulty, approved, MadeWith())));
  return suite.run().cases.at(0);
}

TEST(LoadingFault, MassOfABody) {
  const CaseResult result =
      check_with_loader("box_stack", [](Scene& scene) { body(scene, "box_3").inverse_mass *= 0.5; });
  EXPECT_EQ(result.verdict, Verdict::loading_changed) << result.text;
  EXPECT_EQ(result.cause, "mass or inertia of box_3");
}

/// Everything of a body given in another frame, as where its own is not taken from the file.
void replace_frame(Scene& scene, const std::string& name, const Pose& change) {
  const int index = body_named(scene, name);
  Body& of = body(scene, name);
  const Pose back = change.inverse();
  of.pose = of.pose * change;
  of.body_from_node = back * of.body_from_node;
  for (Collider& collider : scene.colliders) {
    if (collider.body == index) collider.placement = back * collider.placement;
  }
  for (Visual& visual : scene.visuals) {
    if (visual.body != index) continue;
    visual.linear = back.orientation.toRotationMatrix() * visual.linear;
    visual.translation = back * visual.translation;
  }
}

TEST(LoadingFault, CentreOfMassIgnored) {
  // Poses and pictures both differ, but neither simulation nor renderer changed.
  const CaseResult result = check_with_loader("tumbling_body", [](Scene& scene) {
    replace_frame(scene, "handle", {Vector3(0.02, 0, 0), Quaternion::Identity()});
  });
  EXPECT_FALSE(result.poses.passes);
  EXPECT_FALSE(result.images.back().passes);
  EXPECT_EQ(result.verdict, Verdict::loading_changed) << result.text;
  EXPECT_EQ(result.cause.find("start of handle"), 0U) << result.cause;
}

/// A case whose golden picture of the last frame is drawn of a faulty scene.
class RendererFault {
 public:
  RendererFault() : suite_("bouncing_balls", last_frame) { suite_.make_goldens(); }

  PicturePair check_with(const std::function<void(Scene&)>& fault,
                         const std::function<void(Scene&, std::vector<Coordinates>&)>& move = {}) {
    Scene faulty = load_scene(suite_.scene());
    fault(faulty);
    const SuiteCase entry = read_suite(suite_.options.suite).cases.at(0);
    const PoseLog log = read_pose_log(suite_.poses());
    std::vector<Coordinates> poses = log.frames.back().poses;
    if (move) move(faulty, poses);
    CasePainter painter(faulty, entry, log);
    return check_picture(painter.draw_picture(poses));
  }

  /// Draws the right scene with a faulty renderer.
  render::Image drawn_with(const std::function<void(render::RenderSettings&)>& fault) const {
    const SuiteCase entry = read_suite(suite_.options.suite).cases.at(0);
    const Scene scene = load_scene(suite_.scene());
    const PoseLog log = read_pose_log(suite_.poses());
    render::RenderSettings settings;
    settings.width = entry.width;
    settings.height = entry.height;
    fault(settings);
    return render::Renderer(scene, settings, full_frames(log, scene)).draw(log.frames.back().poses);
  }

  render::Image golden() const { return render::read_png(suite_.image(last_frame)); }

  PicturePair check_picture(const render::Image& picture) {
    render::write_png(picture, suite_.image(last_frame));
    suite_.sign();
    const CaseResult result = suite_.run().cases.at(0);
    EXPECT_EQ(result.verdict, Verdict::renderer_changed) << result.text;
    EXPECT_TRUE(result.poses.passes);
    EXPECT_EQ(result.pairs.size(), 1U);
    EXPECT_EQ(result.pairs.at(0).frame, last_frame);
    EXPECT_EQ(result.pairs.at(0).about, PicturePair::About::renderer);
    cause = result.cause;
    return result.pairs.at(0);
  }

  /// The fault is in one body: more of the difference is its own than all others' (whose shadows change a
  /// little, for what casts them changed).
  PicturePair expect_blame(const std::string& name, const std::function<void(Scene&, int)>& fault) {
    const PicturePair pair = check_with([&](Scene& scene) { fault(scene, body_named(scene, name)); });
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

/// The surface of the body, which becomes its own.
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

/// Expects a failure whatever the renderer: a difference that is visible and beyond the tolerance.
void expect_beyond_tolerance(const PicturePair& pair) {
  EXPECT_FALSE(passes(pair.comparison.image.judgement)) << name(pair.comparison.image.judgement);
  EXPECT_EQ(pair.comparison.flip->visibility, "visible");
}

TEST(RendererFault, BlamesNoBodyForLightOrCamera) {
  RendererFault fault;
  const auto expect_everywhere = [&](const std::function<void(Scene&)>& change) {
    const PicturePair pair = fault.check_with(change);
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
}

TEST(RendererFault, BlamesBodyWithoutItsMesh) {
  RendererFault fault;
  expect_beyond_tolerance(
      fault.expect_blame("ball_3", [](Scene& scene, int) { remove_from_picture(scene, "ball_3"); }));
}

TEST(RendererFault, Gamma) {
  RendererFault fault;
  render::Image picture = fault.golden();
  for (std::uint8_t& level : picture.rgb) level = static_cast<std::uint8_t>(level * level / 255);
  fault.check_picture(picture);
  EXPECT_EQ(fault.cause, "light, camera or sky");
}

TEST(RendererFault, ShadowsNotDrawn) {
  RendererFault fault;
  const render::Image picture =
      fault.drawn_with([](render::RenderSettings& settings) { settings.shadows = false; });
  const PicturePair pair = fault.check_picture(picture);
  EXPECT_FALSE(pair.comparison.blame->is_everywhere);
  EXPECT_EQ(fault.cause, "ground and world");
}

TEST(RendererFault, EdgesNotSmoothed) {
  RendererFault fault;
  const render::Image picture =
      fault.drawn_with([](render::RenderSettings& settings) { settings.antialiasing = false; });
  EXPECT_FALSE(fault.check_picture(picture).comparison.blame->is_everywhere);
}

TEST(RendererFault, ABodyThatIsGoneIsCalledGone) {
  // The golden picture has it, and what is drawn now has not: as the sidecar of the whole scene notes.
  SmallSuite suite("bouncing_balls", last_frame);
  suite.make_goldens();
  Scene scene = load_scene(suite.scene());
  remove_from_picture(scene, "ball_3");
  const SuiteCase entry = read_suite(suite.options.suite).cases.at(0);
  const PoseLog log = read_pose_log(suite.poses());
  const Drawing golden{render::read_png(suite.image(last_frame)), {}};
  CasePainter painter(scene, entry, log);
  Drawing drawn = painter.draw(log.frames.back().poses);
  std::vector<std::string> names;
  for (const Body& of : scene.bodies) names.push_back(of.name);
  const Sidecar sidecar = read_sidecar(suite.sidecar());
  const Blame found = blame(golden.picture, drawn.picture, drawn.bodies, drawn.bodies,
                            sidecar.picture(last_frame)->bodies, names);
  EXPECT_FALSE(found.is_everywhere);
  const auto gone = std::find_if(found.bodies.begin(), found.bodies.end(),
                                 [](const BodyBlame& of) { return of.name == "ball_3"; });
  ASSERT_NE(gone, found.bodies.end());
  EXPECT_TRUE(gone->is_gone);
}

TEST(MustFail, MovedBody) {
  RendererFault fault;
  expect_beyond_tolerance(
      fault.check_with([](Scene&) {},
                       [](Scene& scene, std::vector<Coordinates>& poses) {
                         poses[static_cast<std::size_t>(body_named(scene, "ball_2"))].linear.x() += 0.1;
                       }));
}

TEST(MustFail, Hue) {
  // The same mesh in a colour of about the same luminance: grey pictures would hardly differ.
  RendererFault fault;
  expect_beyond_tolerance(fault.check_with([](Scene& scene) {
    Surface& other = own_surface(scene, body_named(scene, "ball_2"));
    std::swap(other.base_color[0], other.base_color[1]);
  }));
}

TEST(MustFail, BlackGolden) {
  RendererFault fault;
  expect_beyond_tolerance(fault.check_picture(render::Image(160, 90)));
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
  const render::Image black = render::read_png(suite_.shown("f0020.new.png"));
  EXPECT_LE(*std::max_element(black.rgb.begin(), black.rgb.end()), 2);
  const std::string message = test::message_of([&] { suite_.approve_failed(); });
  EXPECT_NE(message.find("frame 10 is blank"), std::string::npos) << message;
  EXPECT_FALSE(std::filesystem::exists(suite_.image(20)));
  EXPECT_FALSE(std::filesystem::exists(suite_.poses()));
}

TEST_F(BlackFrame, FailsACheckEvenWhereTheGoldenIsBlackToo) {
  suite_.run();
  write_text(suite_.poses(), read_text(suite_.shown("actual.poses")));
  write_text(suite_.track(), read_text(suite_.shown("actual.track")));
  write_text(suite_.image(10), read_text(suite_.shown("f0010.new.png")));
  write_text(suite_.image(20), read_text(suite_.shown("f0020.new.png")));
  const PoseLog log = read_pose_log(suite_.poses());
  const ApprovableRun run{&log, content_hash(read_bytes(suite_.poses())),
                          content_hash(read_bytes(suite_.track()))};
  const SuiteCase entry = read_suite(suite_.options.suite).cases.at(0);
  const render::Image black = render::read_png(suite_.image(10));
  const render::Image later = render::read_png(suite_.image(20));
  const std::vector<ApprovablePicture> pictures{{&black, {}}, {&later, {}}};
  write_text(suite_.sidecar(),
             sidecar_text(make_sidecar(entry, run, load_scene(suite_.scene()), pictures, MadeWith())));
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.exit_code(), 1);
  EXPECT_EQ(result.cases.at(0).verdict, Verdict::renderer_changed);
  EXPECT_EQ(result.cases.at(0).images.at(0).against_golden->image.judgement, Judgement::exact);
  EXPECT_NE(result.cases.at(0).text.find("the picture is blank"), std::string::npos);
}

}  // namespace
}  // namespace substep::golden
