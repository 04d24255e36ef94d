/// Tests that faults in simulation, renderer and loading are attributed to the right one, body and frame. A
/// faulty run becomes the golden, so that the shipped program differs from it and needs no switch for faults.
/// Another set must fail on every renderer: beyond every tolerance, not only unequal. One file, since all
/// faults share a case that is made, broken and judged.

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

/// A case whose golden run is made by a faulty simulation, with the true divergence from the right run: found
/// by comparing all states, without the code under test.
class SimulationFault {
 public:
  explicit SimulationFault(const std::string& scene_name) : suite_(scene_name, last_frame) {
    suite_.make_goldens();
    settings_ = suite_.entry().settings;
  }

  CheckResult check_with(const std::function<void(Scene&)>& fault, const Procedure& procedure,
                         Verdict verdict) {
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
        const auto& [q, q_bad] = std::pair(good.state().q[i], bad.state().q[i]);
        const auto& [v, v_bad] = std::pair(good.state().v[i], bad.state().v[i]);
        const bool is_same = q.linear == q_bad.linear && q.angular.coeffs() == q_bad.angular.coeffs() &&
                             v.linear == v_bad.linear && v.angular == v_bad.angular;
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
    CasePainter painter(right, suite_.entry(), log);
    for (const int frame : {10, last_frame}) {
      render::write_png(painter.draw_picture(log.frames[static_cast<std::size_t>(frame)].poses),
                        suite_.image(frame));
    }
    suite_.sign();
    CheckResult result = suite_.run();
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
  /// Expects the named body to be the farthest off of those that changed first, and by the reported distance,
  /// within the rounding of both poses.
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
  // The ball falls first.
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
  model("NoGyroscopicTerm", "tumbling_body", {1, 1}, [](Scene& scene) { scene.gyroscopic = false; });
  model("FrictionATenthLess", "incline", {1, 40}, [](Scene& scene) {
    for (Collider& collider : scene.colliders) {
      collider.material.dynamic_friction *= 0.9;
      collider.material.static_friction *= 0.9;
    }
  });
  // Balls fall first.
  model("RestitutionsMultiplied", "bouncing_balls", {5, 40}, [](Scene& scene) {
    for (Collider& collider : scene.colliders) collider.material.restitution_combine = Combine::multiply;
  });
  procedure("SignOfAVelocity", "bouncing_balls", {7, 7},
            altered([](int step, const State& before, CoordinateVector& q, VelocityVector& v) {
              if (step != 7) return;
              q[2].linear.y() = 2 * before.q[2].linear.y() - q[2].linear.y();
              v[2].linear.y() = -v[2].linear.y();
            }));
  procedure("MissingSubstep", "box_stack", {1, 1}, with_settings([](Settings& other) { --other.substeps; }));
  procedure("VelocitiesFadeFromAStepOn", "tumbling_body", {21, 21},
            altered([](int step, const State&, CoordinateVector&, VelocityVector& v) {
              if (step > 20) v[1].angular *= 0.999;
            }));
  procedure("ForgottenBody", "bouncing_balls", {4, 4},
            altered([](int step, const State& before, CoordinateVector& q, VelocityVector&) {
              if (step >= 4) q[3] = before.q[3];
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
  SimulationFault fault(GetParam().scene);
  const CheckResult result = fault.check_with(GetParam().of_model, GetParam().of_procedure, expected.verdict);
  const FirstChange& first = result.poses.motion.first;
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

/// Writes the sidecar of a suite whose poses, track and pictures were written, as of a loaded scene.
void write_sidecar(const SmallSuite& suite, const Scene& scene) {
  std::vector<Sidecar::Picture> pictures;
  for (const int frame : suite.entry().images)
    pictures.push_back({frame, hash_text(hash(render::read_png(suite.image(frame)))), {}});
  const std::string track_hash = content_hash(read_bytes(suite.track()));
  write_text(suite.sidecar(), sidecar_text(make_sidecar(suite.entry(), read_pose_log(suite.poses()),
                                                        track_hash, scene, pictures, MadeWith())));
}

/// Checks a case whose goldens are all made by a faulty loader, with digests of the loaded scene.
CheckResult check_with_loader(const std::string& scene_name, const std::function<void(Scene&)>& fault) {
  SmallSuite suite(scene_name, last_frame);
  suite.make_goldens();
  SuiteCase entry = suite.entry();
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
  for (const int frame : entry.images) {
    render::write_png(painter.draw_picture(log.frames[static_cast<std::size_t>(frame)].poses),
                      suite.image(frame));
  }
  write_sidecar(suite, faulty);
  return suite.run();
}

TEST(LoadingFault, MassOfABody) {
  const CheckResult result =
      check_with_loader("box_stack", [](Scene& scene) { body(scene, "box_3").inverse_mass *= 0.5; });
  EXPECT_EQ(result.verdict, Verdict::loading_changed) << result.text;
  EXPECT_EQ(result.cause, "mass, inertia or gravity factor of box_3");
}

/// Expresses all parts of a body in another frame, as a loader that ignores the body's own frame.
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
  const CheckResult result = check_with_loader("tumbling_body", [](Scene& scene) {
    replace_frame(scene, "handle", {Vector3(0.02, 0, 0), Quaternion::Identity()});
  });
  EXPECT_FALSE(result.poses.passes);
  EXPECT_FALSE(result.images.back().passes);
  EXPECT_EQ(result.verdict, Verdict::loading_changed) << result.text;
  EXPECT_EQ(result.cause.find("initial pose or velocity of handle"), 0U) << result.cause;
}

/// A case whose golden picture of the last frame is drawn of a faulty scene.
class RendererFault {
 public:
  RendererFault() : suite_("bouncing_balls", last_frame) { suite_.make_goldens(); }

  PicturePair check_with(const std::function<void(Scene&)>& fault,
                         const std::function<void(Scene&, std::vector<Coordinates>&)>& move = {}) {
    Scene faulty = load_scene(suite_.scene());
    fault(faulty);
    const SuiteCase entry = suite_.entry();
    const PoseLog log = read_pose_log(suite_.poses());
    std::vector<Coordinates> poses = log.frames.back().poses;
    if (move) move(faulty, poses);
    CasePainter painter(faulty, entry, log);
    return check_picture(painter.draw_picture(poses));
  }

  /// Draws the right scene with a faulty renderer.
  render::Image drawn_with(const std::function<void(render::RenderSettings&)>& fault) const {
    const SuiteCase entry = suite_.entry();
    const Scene scene = load_scene(suite_.scene());
    const PoseLog log = read_pose_log(suite_.poses());
    render::RenderSettings settings{.width = entry.width, .height = entry.height};
    fault(settings);
    return render::Renderer(scene, settings, full_frames(log, scene)).draw(log.frames.back().poses);
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

TEST(RendererFault, BlamesNoBodyForGammaShadowsOrEdges) {
  RendererFault fault;
  render::Image picture = fault.golden();
  for (std::uint8_t& level : picture.rgb) level = static_cast<std::uint8_t>(level * level / 255);
  fault.check_picture(picture);
  EXPECT_EQ(fault.cause, "light, camera or sky");
  const auto is_everywhere = [&](void (*change)(render::RenderSettings&)) {
    return fault.check_picture(fault.drawn_with(change)).comparison.blame->is_everywhere;
  };
  EXPECT_FALSE(is_everywhere([](render::RenderSettings& settings) { settings.shadows = false; }));
  EXPECT_EQ(fault.cause, "ground and world");
  EXPECT_FALSE(is_everywhere([](render::RenderSettings& settings) { settings.antialiasing = false; }));
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

TEST(MustFail, MovedBodyHueAndBlackGolden) {
  RendererFault fault;
  const auto shift = [](Scene& scene, std::vector<Coordinates>& poses) {
    poses[static_cast<std::size_t>(body_named(scene, "ball_2"))].linear.x() += 0.1;
  };
  expect_beyond_tolerance(fault.check_with([](Scene&) {}, shift));
  // Take a colour of about equal luminance: grey pictures would hardly differ.
  expect_beyond_tolerance(fault.check_with([](Scene& scene) {
    Surface& other = own_surface(scene, body_named(scene, "ball_2"));
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
  write_text(suite_.poses(), read_text(suite_.shown("actual.poses")));
  write_text(suite_.track(), read_text(suite_.shown("actual.track")));
  write_text(suite_.image(10), read_text(suite_.shown("f0010.new.png")));
  write_text(suite_.image(20), read_text(suite_.shown("f0020.new.png")));
  write_sidecar(suite_, load_scene(suite_.scene()));
  const CheckResult result = suite_.run();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.verdict, Verdict::renderer_changed);
  EXPECT_EQ(result.images.at(0).against_golden->image.judgement, Judgement::exact);
  EXPECT_THAT(result.text, testing::HasSubstr("the picture is blank"));
}

}  // namespace
}  // namespace substep::golden
