/// Tests how each part of a scene's file is loaded.
/// One file, since all tests change one example.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/loading/load_scene.h"
#include "sim/measure/json.h"
#include "tests/scene/example_scene.h"
#include "tests/scene_files.h"

namespace substep {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;
using namespace test;

constexpr double pi = std::numbers::pi;

void expect_near(const Vector3& actual, const Vector3& expected, double tolerance) {
  EXPECT_LE((actual - expected).norm(), tolerance)
      << "is " << actual.transpose() << ", should be " << expected.transpose();
}

// Returns the pose of the body's node in the world.
Pose node_pose(const Body& body) {
  return body.pose * body.body_from_node;
}

TEST(LoadScene, ReadsTheExample) {
  const Scene scene = load(example());
  EXPECT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.colliders.size(), 3u);
  // The rock's collider takes its node's scale alone: 2 × 1 × 1 m³ of water. Its inertia is off by 2e-13.
  expect_scene(scene, R"(
    /scene | "example"
    /warnings | []
    /bodies/0/name | "world"
    /bodies/0/colliders/0/shape | "plane"
    /bodies/0/colliders/0/systems | null
    /bodies/1/name | "crate"
    /bodies/1/mass | 2
    /bodies/1/inertia | [0.3333333333333333, 0.3333333333333333, 0.3333333333333333] | 1e-15
    /bodies/1/position | [0, 2, 0]
    /bodies/1/orientation | [1, 0, 0, 0]
    /bodies/1/linearVelocity | [1, 0, 0]
    /bodies/1/colliders/0/size | [1, 1, 1]
    /bodies/1/colliders/0/material | {"staticFriction": 0.5, "dynamicFriction": 0.4, "restitution": 0.3,
                                      "frictionCombine": "minimum", "restitutionCombine": null}
    /bodies/1/colliders/0/systems | [0, 1]
    /bodies/1/colliders/0/exceptSystems | [1, 2]
    /bodies/2/name | "rock"
    /bodies/2/mass | 2000 | 1e-9
    /bodies/2/inertia | [333.3333333333333, 833.3333333333333, 833.3333333333333] | 1e-9
    /bodies/2/position | [3, 1, 0] | 1e-15
    /bodies/2/colliders/0/faces | 6
    /bodies/2/colliders/0/points | [[-1, -0.5, -0.5], [1, -0.5, -0.5], [-1, 0.5, -0.5], [1, 0.5, -0.5],
                                    [-1, -0.5, 0.5], [1, -0.5, 0.5], [-1, 0.5, 0.5], [1, 0.5, 0.5]]
    /joints/0/name | "hook"
    /joints/0/indices | [1, 0]
    /joints/0/frames/0/position | [0, 0.5, 0]
    /joints/0/frames/1/position | [0, 2.5, 0]
    /joints/0/bodiesCollide | false
    /joints/0/silentColliders | []
    /joints/0/limits | [{"type": "linear", "axes": "xyz", "min": 0, "max": 0, "stiffness": null, "damping": 0}]
    /joints/0/drives | [{"type": "angular", "axis": "z", "mode": "force", "maxForce": 5, "positionTarget": 0,
                         "velocityTarget": 2, "stiffness": 0, "damping": 10}])");
}

TEST(LoadScene, JointSilencesStaticCollidersOfItsNodeAlone) {
  // The nail gets a collider, a post above it, a head below it beside the crate, and a sibling.
  const Json document = edited(R"(
    /nodes/3/$/collider/geometry/shape = 1; /nodes/3/children = [10, 1];
    /nodes/8/$/collider/geometry/shape = 1; /nodes/8/name = "post"; /nodes/8/children = [3, 9];
    /nodes/9/$/collider/geometry/shape = 1; /nodes/9/name = "sibling";
    /nodes/10/$/collider/geometry/shape = 1; /nodes/10/name = "head";
    /scenes/0/nodes = [0, 4, 6, 7, 8])");
  // Colliders are in the order of the nodes: ground, crate, nail, rock, post, sibling, head.
  EXPECT_EQ(load(document).joints.at(0).silent_colliders, (std::vector<int>{2, 4, 6}));
}

TEST(LoadScene, DrawsMeshesWithTheirBodies) {
  const Scene scene = load(example());
  ASSERT_EQ(scene.visuals.size(), 1u);  // the rock has no mesh of its own
  EXPECT_EQ(scene.visuals[0].body, 1);
  EXPECT_EQ(scene.visuals[0].linear, Matrix3(Matrix3::Identity()));
  EXPECT_EQ(scene.visuals[0].translation, Vector3(0, 0, 0));
  const Json mixed = edited(skinned(example(), 1, "[3, 3]"),
                            R"(/meshes/0/primitives/- = {"attributes": {"POSITION": 0}, "indices": 1})");
  EXPECT_EQ(load(mixed).visuals.at(1).body, 1);  // a primitive without weights follows its node
  ASSERT_EQ(scene.meshes.size(), 1u);
  const Mesh& mesh = scene.meshes[0];
  EXPECT_EQ(mesh.name, "cube");
  EXPECT_EQ(mesh.triangles.size(), 12u);
  // No normals in the file, so each triangle has its own.
  ASSERT_EQ(mesh.positions.size(), 36u);
  ASSERT_EQ(mesh.normals.size(), 36u);
  for (std::size_t i = 0; i < 36; ++i) EXPECT_EQ(mesh.normals[i].dot(mesh.positions[i]), 0.5);
  const Surface& surface = scene.surfaces.at(mesh.surface);
  EXPECT_EQ(surface.name, "wood");
  EXPECT_EQ(surface.base_color, (std::array{0.5, 0.25, 0.125}));
  EXPECT_EQ(surface.metallic, 0);
  EXPECT_EQ(surface.roughness, 0.75);

  ASSERT_TRUE(scene.camera);
  EXPECT_EQ(scene.camera->vertical_field_of_view, 0.7);
  EXPECT_EQ(scene.camera->pose.position, Vector3(0, 1, 8));
  ASSERT_TRUE(scene.sun);
  expect_near(scene.sun->direction, {0, -1, 0}, 1e-15);
  EXPECT_EQ(scene.sun->illuminance, 3);
  // Daylight in lux is scaled down.
  EXPECT_EQ(load(edited("/extensions/KHR_lights_punctual/lights/0/intensity = 80000")).sun->illuminance, 3);
  EXPECT_EQ(scene.sun->color, (std::array{1., 0.9, 0.8}));
}

TEST(LoadScene, KeepsGivenNormals) {
  // Give a cube's corners as normals: the loader normalizes them.
  const Scene scene = load(edited("/meshes/0/primitives/0/attributes/NORMAL = 0"));
  ASSERT_EQ(scene.meshes[0].positions.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    expect_near(scene.meshes[0].normals[i], scene.meshes[0].positions[i] * (2 / std::sqrt(3.)), 1e-15);
  }
}

TEST(LoadScene, GlbMatchesGltf) {
  Json document = example();
  const Scene from_gltf = load(document);
  document["buffers"][0].erase("uri");
  const TemporaryFolder folder;
  const Scene from_glb = load_scene(folder.write("example.glb", glb(document.dump(), cube_buffer())));
  Json of_gltf = scene_json(from_gltf);
  const Json of_glb = scene_json(from_glb);
  for (const char* const key : {"file", "hash"}) of_gltf[key] = of_glb[key];
  EXPECT_EQ(of_glb, of_gltf);
  EXPECT_EQ(from_glb.meshes[0].positions, from_gltf.meshes[0].positions);
}

TEST(LoadScene, HashCoversTheFileAndItsBuffers) {
  const Json document = edited(R"(/buffers/0/uri = "parts/a%20c%C3%BCbe.bin")");
  const TemporaryFolder folder;
  folder.write("parts/a cübe.bin", cube_buffer());
  const auto file = folder.write("example.gltf", document.dump());
  const Scene scene = load_scene(file);
  EXPECT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(load_scene(folder.write("other name.gltf", document.dump())).hash, scene.hash);
  folder.write("parts/a cübe.bin", cube_buffer() + "x");
  EXPECT_NE(load_scene(file).hash, scene.hash);
  folder.write("parts/a cübe.bin", cube_buffer());
  EXPECT_NE(load_scene(folder.write("example.gltf", document.dump() + " ")).hash, scene.hash);
}

TEST(LoadScene, ReadsSettingsFromExtras) {
  const Scene defaults = load(example());
  EXPECT_EQ(defaults.gravity, Vector3(0, -9.81, 0));
  EXPECT_EQ(defaults.duration, 5);
  EXPECT_EQ(defaults.step, 1. / 60);
  EXPECT_EQ(defaults.substeps, 45);  // for 2 kg and 2 t, by DerivesSubstepsFromMassesAndLoops
  EXPECT_FALSE(defaults.poster);
  EXPECT_TRUE(defaults.gyroscopic);
  const Scene scene = load(edited(R"(
    /extras = {"other": 1, "substep": {"gravity": [0, 0, -1.5], "duration": 2}};
    /scenes/0/extras/substep =
      {"duration": 3, "step": 0.01, "substeps": 17, "poster": 2, "gyroscopic": false})"));
  EXPECT_EQ(scene.gravity, Vector3(0, 0, -1.5));
  EXPECT_EQ(scene.duration, 3);
  EXPECT_EQ(scene.step, 0.01);
  EXPECT_EQ(scene.substeps, 17);
  EXPECT_EQ(scene.poster, 2);
  EXPECT_FALSE(scene.gyroscopic);
  EXPECT_THAT(scene.warnings, testing::ElementsAre(HasSubstr("/extras/substep/gravity: is along z")));
}

TEST(LoadScene, DerivesSubstepsFromMassesAndLoops) {
  const auto substeps = [](double crate, double rock) {
    const char* const edits = "/nodes/1/$/motion/mass = {}; /nodes/4/$/motion/mass = {}";
    return load(edited(fmt::format(fmt::runtime(edits), crate, rock))).substeps;
  };
  EXPECT_EQ(substeps(2, 100), 10);      // √(2·50)
  EXPECT_EQ(substeps(2, 102), 11);      // √102 = 10.0995…
  EXPECT_EQ(substeps(1000, 1), 45);     // √2000 = 44.7…
  EXPECT_EQ(substeps(0.01, 500), 100);  // the maximum
  EXPECT_EQ(substeps(0, 500), 10);      // 0 kg: no force moves it, so that its joint constrains nothing
  EXPECT_EQ(scene_named("four_bar").substeps, 40);
  EXPECT_EQ(scene_named("rod_chain").substeps, 10);
}

TEST(LoadScene, TakesTheDefaultSceneOrAllRoots) {
  const Scene second = load(edited("/scenes/1/nodes = [4]; /scene = 1"));
  ASSERT_EQ(second.bodies.size(), 2u);
  EXPECT_EQ(second.bodies[1].name, "rock");
  const Scene all = load(edited("/scene =; /scenes ="));
  EXPECT_EQ(all.bodies.size(), 3u);
  EXPECT_EQ(all.visuals.size(), 2u);  // without scenes every root is loaded, node 5 too
}

TEST(LoadScene, MakesNamesUnique) {
  const auto expect_names = [](const char* edits, const char* crate, const char* rock) {
    const Scene scene = load(edited(edits));
    EXPECT_EQ(scene.bodies[1].name, crate);
    EXPECT_EQ(scene.bodies[2].name, rock);
  };
  expect_names(R"(/nodes/0/name = "a"; /nodes/1/name = "a"; /nodes/3/name = "a #2"; /nodes/4/name =)", "a #2",
               "node 4");
  expect_names(R"(/nodes/1/name = "world"; /nodes/4/name = "two\nlines")", "world #2", "two lines");
}

struct ShapeCase {
  const char* name;
  const char* shape;
  double volume;
  Vector3 moments;  // of unit density, about the node's axes
};

const std::vector<ShapeCase> shapes{
    {"sphere", R"({"type": "sphere", "sphere": {"radius": 0.3}})", 4 * pi / 3 * 0.027,
     Vector3::Constant(0.4 * 4 * pi / 3 * 0.027 * 0.09)},
    {"default_sphere", R"({"type": "sphere"})", pi / 6, Vector3::Constant(0.4 * pi / 6 * 0.25)},
    {"box", R"({"type": "box", "box": {"size": [1, 2, 3]}})", 6, {6 * 13 / 12., 6 * 10 / 12., 6 * 5 / 12.}},
    {"cube", R"({"type": "box", "box": {"size": [0.1, 0.1, 0.1]}})", 1e-3, Vector3::Constant(1e-5 / 6)},
    {"capsule", R"({"type": "capsule", "capsule": {"height": 2, "radiusBottom": 0.5, "radiusTop": 0.5}})",
     pi / 2 + pi / 6,
     // Cylinder and two half balls whose centres of mass lie 3 r / 8 beyond its ends.
     Vector3(pi / 2 * (4 + 3 * 0.25) / 12 + pi / 6 * (0.4 * 0.25 + 1 + 0.75 * 0.5),
             pi / 2 * 0.125 + pi / 6 * 0.1,
             pi / 2 * (4 + 3 * 0.25) / 12 + pi / 6 * (0.4 * 0.25 + 1 + 0.75 * 0.5))},
    {"capsule_without_length",
     R"({"type": "capsule", "capsule": {"height": 0, "radiusBottom": 0.5, "radiusTop": 0.5}})", pi / 6,
     Vector3::Constant(0.4 * pi / 6 * 0.25)},
    {"cylinder",
     R"({"type": "cylinder", "cylinder": {"height": 2, "radiusBottom": 1, "radiusTop": 1}})",
     2 * pi,
     {2 * pi * 7 / 12, pi, 2 * pi * 7 / 12}}};

TEST(LoadScene, MassOfShapeDefaultsToWater) {
  for (const ShapeCase& expected : shapes) {
    SCOPED_TRACE(expected.name);
    const Body water = load(one_body("{}", expected.shape)).bodies[1];
    // Measured over all cases: 3e-16 relative.
    EXPECT_NEAR(1 / water.inverse_mass / (1000 * expected.volume), 1, 1e-14);
    expect_near(water.inverse_inertia.cwiseInverse() / (1000 * expected.moments.norm()),
                expected.moments / expected.moments.norm(), 1e-14);
    const Body given = load(one_body(R"({"mass": 3})", expected.shape)).bodies[1];
    EXPECT_EQ(given.inverse_mass, 1. / 3);
    expect_near(given.inverse_inertia.cwiseInverse() / (3 / expected.volume * expected.moments.norm()),
                expected.moments / expected.moments.norm(), 1e-14);
    // Equal moments are equal to the last bit, and the axes are the node's.
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      EXPECT_EQ(water.inverse_inertia[i] == water.inverse_inertia[j],
                expected.moments[i] == expected.moments[j]);
    }
    EXPECT_EQ(water.pose.orientation.coeffs().cwiseAbs(), Quaternion::Identity().coeffs());
  }
}

Body body_with(const std::string& motion, const std::string& edits = "/nodes/0/name = \"body\"") {
  return load(edited(one_body(motion, R"({"type": "box"})"), edits)).bodies[1];
}

TEST(LoadScene, BodyWithoutColliderIsBallOfWater) {
  for (const double mass : {0.02, 2.0, 7000.0}) {
    const Body body = body_with(fmt::format(R"({{"mass": {}}})", mass), "/nodes/0/$/collider =");
    const double radius = std::cbrt(mass / (4.0 / 3 * pi * 1000));
    const double moment = 0.4 * mass * radius * radius;
    expect_near(body.inverse_inertia.cwiseInverse() / moment, Vector3::Ones(), 1e-14);
  }
}

TEST(LoadScene, ReadsZeroAndKinematicAsInfinite) {
  const Body fixed = body_with(R"({"mass": 0})");
  EXPECT_EQ(fixed.inverse_mass, 0);
  EXPECT_EQ(fixed.inverse_inertia, Vector3(0, 0, 0));
  const Body axle = body_with(R"({"mass": 4, "inertiaDiagonal": [0, 2, 0]})");
  EXPECT_EQ(axle.inverse_mass, 0.25);
  EXPECT_EQ(axle.inverse_inertia, Vector3(0, 0.5, 0));
  const Body turning = body_with(
      R"({"isKinematic": true, "mass": 4, "inertiaDiagonal": [1, 2, 3], "angularVelocity": [0, 5, 0]})");
  EXPECT_EQ(turning.inverse_mass, 0);
  EXPECT_EQ(turning.inverse_inertia, Vector3(0, 0, 0));
  EXPECT_EQ(turning.angular_velocity, Vector3(0, 5, 0));
}

TEST(LoadScene, BodyFrameFollowsPrincipalAxes) {
  const Json document = one_body(
      R"({"mass": 1, "centerOfMass": [1, 2, 3], "inertiaDiagonal": [1, 2, 4],
          "inertiaOrientation": [0, 0, 0.7071067811865476, 0.7071067811865476],
          "linearVelocity": [1, 0, 0], "angularVelocity": [0, 1, 0], "gravityFactor": -0.5})",
      R"({"type": "sphere"})");
  const char* const turned =  // +x → −z, +z → +x
      "/nodes/0/translation = [10, 0, 0]; /nodes/0/rotation = [0, 0.7071067811865476, 0, 0.7071067811865476]";
  const Scene scene = load(edited(document, turned));
  const Body& body = scene.bodies[1];
  EXPECT_EQ(body.inverse_inertia, Vector3(1, 0.5, 0.25));
  EXPECT_EQ(body.gravity_factor, -0.5);
  expect_near(body.pose.position, {13, 2, -1}, 1e-14);
  // The first principal axis is the node's y, which is the world's; the second the node's −x, the world's z.
  expect_near(body.pose.orientation * Vector3::UnitX(), {0, 1, 0}, 1e-15);
  expect_near(body.pose.orientation * Vector3::UnitY(), {0, 0, 1}, 1e-15);
  expect_near(body.linear_velocity, {0, 0, -1}, 1e-15);
  expect_near(body.angular_velocity, {0, 1, 0}, 1e-15);
  expect_near(node_pose(body).position, {10, 0, 0}, 1e-14);
  // The collider stays where the node is.
  expect_near((body.pose * scene.colliders[0].placement).position, {10, 0, 0}, 1e-14);
}

TEST(LoadScene, CompoundIsOneSolid) {
  // Two unit cubes at x = ±1, of which one is turned by a quarter about x, as children of a node without a
  // shape.
  const Scene scene = load(edited(one_body("{}", R"({"type": "box"})"), R"(
    /nodes/0/$/collider =;
    /nodes/0/children = [1, 2];
    /nodes/0/translation = [0, 0, 7];
    /nodes/1/$/collider/geometry/shape = 0;
    /nodes/1/translation = [1, 0, 0];
    /nodes/2/$/collider/geometry/shape = 0;
    /nodes/2/translation = [-1, 0, 0];
    /nodes/2/rotation = [0.7071067811865476, 0, 0, 0.7071067811865476])"));
  ASSERT_EQ(scene.bodies.size(), 2u);
  const Body& body = scene.bodies[1];
  EXPECT_NEAR(1 / body.inverse_mass, 2000, 1e-10);
  expect_near(body.inverse_inertia.cwiseInverse(), 2000 * Vector3(1 / 6., 1 / 6. + 1, 1 / 6. + 1), 1e-10);
  EXPECT_EQ(body.inverse_inertia.y(), body.inverse_inertia.z());
  expect_near(body.pose.position, {0, 0, 7}, 1e-15);
  ASSERT_EQ(scene.colliders.size(), 2u);
  expect_near(scene.colliders[0].placement.position, {1, 0, 0}, 1e-15);
  expect_near(scene.colliders[1].placement.position, {-1, 0, 0}, 1e-15);
}

TEST(LoadScene, BodyBelowAnotherIsSeparate) {
  const Scene scene = load(edited(one_body("{}", R"({"type": "box"})"), R"(
    /nodes/0/children = [1]; /nodes/0/translation = [0, 1, 0]; /nodes/1/translation = [0, 2, 0];
    /nodes/1/$ = {"motion": {}, "collider": {"geometry": {"shape": 0}}})"));
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.colliders[0].body, 1);
  EXPECT_EQ(scene.colliders[1].body, 2);
  EXPECT_EQ(scene.bodies[2].pose.position, Vector3(0, 3, 0));
}

TEST(LoadScene, ScaleGoesIntoShape) {
  const Scene ball = load(edited(one_body("{}", R"({"type": "sphere"})"), "/nodes/0/scale = [-2, -2, -2]"));
  EXPECT_EQ(std::get<Sphere>(ball.colliders[0].shape).radius, 1);
  for (const char* const scale : {"/nodes/0/scale = [2, -3, 4]; /nodes/0/translation = [5, 6, 7]",
                                  "/nodes/0/matrix = [0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 5, 6, 7, 1]"}) {
    const Scene box = load(edited(one_body("{}", R"({"type": "box"})"), scale));
    const Body& body = box.bodies[1];
    EXPECT_NEAR(1 / body.inverse_mass, 24000, 1e-9);
    EXPECT_EQ(node_pose(body).position, Vector3(5, 6, 7));
    const bool is_turned = std::string(scale).find("matrix") != std::string::npos;
    for (const Vector3& vertex : std::get<Polytope>(box.colliders[0].shape).vertices) {
      const Vector3 in_world = body.pose * (box.colliders[0].placement * vertex) - Vector3(5, 6, 7);
      if (is_turned) {
        expect_near(in_world.cwiseAbs(), {1.5, 1, 2}, 1e-14);
      } else {
        EXPECT_EQ(in_world.cwiseAbs(), Vector3(1, 1.5, 2));
      }
    }
  }
}

TEST(LoadScene, MirrorTurnsVelocitiesAndMeshes) {
  for (const char* mirror :
       {"/nodes/1/scale = [1, -1, 1]",
        "/nodes/1/translation =; /nodes/1/matrix = [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 2, 0, 1]"}) {
    const char* const moves =
        "/nodes/1/$/motion = {\"linearVelocity\": [1, 2, 3], \"angularVelocity\": [1, 2, 3]}";
    const Scene scene = load(edited(edited(mirror), moves));
    const Body& body = scene.bodies[1];
    expect_near(body.linear_velocity, {1, -2, 3}, 0);
    expect_near(body.angular_velocity, {-1, 2, -3}, 0);  // an axial vector
    const Visual& visual = scene.visuals[0];
    expect_near(body.pose.orientation * (visual.linear * Vector3(1, 2, 3)), {1, -2, 3}, 0);
    // The hook hangs below the crate now.
    EXPECT_EQ(body.pose * scene.joints[0].frame_a.position, Vector3(0, 1.5, 0));
  }
}

TEST(MirroredNode, KeepsAxesOfShapesJointsCamerasAndLights) {
  const char* const cone =
      R"({"type": "cylinder", "cylinder": {"height": 1, "radiusBottom": 0.5, "radiusTop": 0}})";
  for (int signs = 0; signs < 8; ++signs) {
    SCOPED_TRACE(signs);
    const Vector3 scale(signs & 1 ? -1 : 1, signs & 2 ? -1 : 1, signs & 4 ? -1 : 1);
    const Vector3 y = scale.y() * Vector3::UnitY();
    const Vector3 z = scale.z() * Vector3::UnitZ();
    const auto scaled = [&](const Json& document, int node) {
      return load(edited(
          document, fmt::format("/nodes/{}/scale = [{}, {}, {}]", node, scale.x(), scale.y(), scale.z())));
    };
    const Scene moving = scaled(one_body("{}", cone), 0);
    const Pose collider = moving.bodies[1].pose * moving.colliders[0].placement;
    expect_near(moving.bodies[1].pose.position, -0.25 * y, 1e-12);  // a quarter of the height above the base
    expect_near(collider.orientation * Vector3::UnitY(), y, 1e-14);
    EXPECT_EQ(scaled(example(), 0).colliders[0].placement.orientation * Vector3::UnitY(), y);
    const Joint nail = scaled(example(), 3).joints[0];
    EXPECT_EQ(nail.frame_b.orientation * Vector3::UnitY(), y);
    EXPECT_EQ(nail.frame_b.orientation * Vector3::UnitZ(), z);
    const Scene crate = scaled(example(), 1);
    const Pose hook = crate.bodies[1].pose * crate.joints[0].frame_a;
    expect_near(hook.orientation * Vector3::UnitY(), y, 1e-14);
    expect_near(hook.orientation * Vector3::UnitZ(), z, 1e-14);
    const Scene viewed = scaled(example(), 6);
    EXPECT_EQ(viewed.camera->pose.orientation * Vector3::UnitY(), y);
    EXPECT_EQ(viewed.camera->pose.orientation * Vector3::UnitZ(), z);
    expect_near(scaled(example(), 7).sun->direction, -scale.z() * Vector3::UnitY(), 1e-14);
  }
}

TEST(LoadScene, ReadsEachCombineMode) {
  const auto read = [](const char* friction, const char* restitution) {
    const Json material{{"frictionCombine", friction}, {"restitutionCombine", restitution}};
    const Scene scene = load(edited("/$/physicsMaterials/0 = " + material.dump()));
    return std::pair(scene.colliders[1].material.friction_combine,
                     scene.colliders[1].material.restitution_combine);
  };
  EXPECT_EQ(read("average", "minimum"), std::pair(Combine::average, Combine::minimum));
  EXPECT_EQ(read("minimum", "maximum"), std::pair(Combine::minimum, Combine::maximum));
  EXPECT_EQ(read("maximum", "multiply"), std::pair(Combine::maximum, Combine::multiply));
  EXPECT_EQ(read("multiply", "average"), std::pair(Combine::multiply, Combine::average));
}

TEST(LoadScene, TurnedNodeIsDrawnSheared) {
  const Scene scene = load(edited(R"(/nodes/3/mesh = 0; /nodes/3/translation =;
    /nodes/3/rotation = [0, 0, 0.3826834323650898, 0.9238795325112867];
    /nodes/- = {"scale": [3, 1, 1], "children": [3]}; /scenes/0/nodes = [0, 8])"));
  ASSERT_EQ(scene.visuals.size(), 1u);
  const double r = std::sqrt(0.5);
  expect_near(scene.visuals[0].linear * Vector3::UnitX(), {3 * r, r, 0}, 1e-15);
  expect_near(scene.visuals[0].linear * Vector3::UnitY(), {-3 * r, r, 0}, 1e-15);
  // The scale turns what a camera faces: its z axis is (1, 0, 1)/√2 before, (3, 0, 1)/√10 after.
  const Scene viewed = load(edited(R"(/nodes/6/rotation = [0, 0.3826834323650898, 0, 0.9238795325112867];
    /nodes/- = {"scale": [3, 1, 1], "children": [6]}; /scenes/0/nodes = [0, 8])"));
  expect_near(viewed.camera->pose.orientation * Vector3::UnitZ(), Vector3(3, 0, 1) / std::sqrt(10.0), 1e-14);
}

TEST(LoadScene, ColliderTakesMesh) {
  // The collider names the rock's mesh in place of the mesh's node.
  const Scene scene = load(edited(R"(/nodes/4/$/collider/geometry = {"mesh": 0, "convexHull": true})"));
  const Scene with_node = load(example());
  EXPECT_EQ(std::get<Polytope>(scene.colliders[2].shape).vertices,
            std::get<Polytope>(with_node.colliders[2].shape).vertices);
  EXPECT_EQ(scene.bodies[2].inverse_mass, with_node.bodies[2].inverse_mass);
  EXPECT_THAT(scene.warnings, IsEmpty());
  // A moving body collides as the hull, asked for or not.
  const Scene moving = load(edited("/nodes/4/$/collider/geometry/convexHull ="));
  EXPECT_EQ(std::get<Polytope>(moving.colliders[2].shape).vertices,
            std::get<Polytope>(with_node.colliders[2].shape).vertices);
  EXPECT_THAT(moving.warnings,
              Contains(HasSubstr("the mesh of node 'rock shape' moves, so it collides as its convex hull")));
  // Two cubes that overlap by half cut through each other: their hull of 3 m³ gives the mass, not their sum.
  const Scene overlapping = load(edited(R"(/nodes/4/$/collider/geometry/convexHull =;
    /nodes/- = {"mesh": 0, "translation": [0.5, 0, 0]}; /nodes/5/children = [8])"));
  EXPECT_NEAR(1 / overlapping.bodies[2].inverse_mass, 3000, 1e-9);
  EXPECT_THAT(overlapping.warnings, Contains(HasSubstr("hull, which also gives its mass properties")));
  // A static collider keeps the triangles.
  const Scene in_world = load(edited(R"(/nodes/4/$ = {"collider": {"geometry": {"mesh": 0}}})"));
  EXPECT_EQ(std::get<TriangleMesh>(in_world.colliders[2].shape).triangles.size(), 12U);
  EXPECT_THAT(complaint(edited(R"(/nodes/4/$/collider/geometry = {"mesh": 1})")),
              HasSubstr("/collider/geometry/mesh: there is no mesh 1: the file has 1"));
}

TEST(LoadScene, ReadsShapesOfGltf21) {
  const Json document = edited(R"(/asset/version = "2.1"; /extensions/KHR_implicit_shapes =;
    /extensionsUsed = ["KHR_physics_rigid_bodies"]; /extensionsRequired = ["KHR_physics_rigid_bodies"];
    /shapes = [{"type": "plane"}, {"type": "box", "box": {"size": [1, 1, 1]}},
               {"type": "convex", "convex": {"mesh": 0}}, {"type": "concave", "concave": {"mesh": 0}}];
    /nodes/4/$/collider/geometry = {"shape": 2})");
  const Scene scene = load(document);
  const Scene extended = load(example());
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(std::get<Polytope>(scene.colliders[i].shape).vertices,
              std::get<Polytope>(extended.colliders[i].shape).vertices);
  }
  EXPECT_THAT(scene.warnings, IsEmpty());
  const Scene still = load(edited(document, R"(/nodes/4/$ = {"collider": {"geometry": {"shape": 3}}})"));
  EXPECT_TRUE(std::holds_alternative<TriangleMesh>(still.colliders[2].shape));
  // Colliders of the extension refer to the extension's shapes.
  const Scene both = load(edited(R"(/shapes = [{"type": "sphere"}, {"type": "sphere"}])"));
  EXPECT_TRUE(std::holds_alternative<Plane>(both.colliders[0].shape));
  EXPECT_EQ(both.warnings,
            std::vector<std::string>{"/shapes: are ignored: the file has those of KHR_implicit_shapes too"});
}

TEST(LoadScene, WarnsOfJointsThatStartOpen) {
  EXPECT_EQ(warnings(edited("/nodes/3/translation = [0.3, 2.9, 0]")),
            pointer("/nodes/2/$/joint") + ": 'hook' starts 0.5 m open\n");
  // Bent by 120° about an axis across the free one, beside a turn of 40° about that.
  const char* const hinge = R"(/$/physicsJoints/0/limits/- = {"angularAxes": [0, 1], "min": 0, "max": 0}; )";
  EXPECT_EQ(warnings(edited(std::string(hinge) +
                            "/nodes/2/rotation = [0.8137977, -0.2961981, 0.1710101, 0.4698463]")),
            pointer("/nodes/2/$/joint") + ": 'hook' starts 120° open\n");
  EXPECT_EQ(warnings(edited(std::string(hinge) + "/nodes/2/rotation = [0, 0, 1, 0]")), "");
}

TEST(LoadScene, WarnsOfUnknownKeysInExtensions) {
  for (const char* place :
       {"/nodes/1/$", "/nodes/1/$/motion", "/nodes/1/$/collider", "/nodes/1/$/collider/geometry",
        "/nodes/2/$/joint", "/$", "/$/physicsMaterials/0", "/$/collisionFilters/0", "/$/physicsJoints/0",
        "/$/physicsJoints/0/limits/0", "/$/physicsJoints/0/drives/0", "/#/1", "/#/1/box"}) {
    EXPECT_THAT(warnings(edited(std::string(place) + "/mas = 3")),
                StartsWith(pointer(place) + ": unknown key 'mas' is ignored; known are "));
  }
  EXPECT_THAT(warnings(edited("/extensions/KHR_implicit_shapes/mas = 3")), HasSubstr("unknown key 'mas'"));
  EXPECT_EQ(warnings(edited("/nodes/1/$/motion/extras/mas = 3")), "");
}

TEST(LoadScene, HullHoldsMeshesOfChildren) {
  const Scene scene =
      load(edited(R"(/nodes/- = {"mesh": 0, "translation": [1, 0, 0]}; /nodes/5/children = [8])"));
  // 2 × 1 × 1 under a scale of 2 along x, with its centre 1 m off.
  EXPECT_NEAR(1 / scene.bodies[2].inverse_mass, 4000, 1e-9);
  expect_near(scene.bodies[2].pose.position, {4, 1, 0}, 1e-14);
}

TEST(HullCollider, LeavesOutUnusedVertices) {
  // Three triangles use all corners of the cube but one, which cuts off a sixth of 2 m³.
  const Scene scene = load(edited("/accessors/1/count = 9"));
  EXPECT_EQ(std::get<Polytope>(scene.colliders[2].shape).vertices.size(), 7U);
  EXPECT_NEAR(1 / scene.bodies[2].inverse_mass, 5000.0 / 3, 1e-9);
}

TEST(LoadScene, ReadsTexturesOfMaterial) {
  const Scene scene = load(edited(R"(
    /images = [{"bufferView": 2, "mimeType": "image/png"}];
    /bufferViews/- = {"buffer": 1, "byteOffset": 1, "byteLength": 8};
    /buffers/- = {"byteLength": 9, "uri": "data:;base64,AIlQTkcNChoK"};
    /samplers = [{"wrapS": 33648, "wrapT": 33071, "magFilter": 9728, "minFilter": 9985}];
    /textures = [{"source": 0, "sampler": 0}];
    /materials/0/pbrMetallicRoughness/baseColorTexture = {"index": 0, "texCoord": 0, "extensions":
      {"KHR_texture_transform": {"offset": [0.25, 0.5], "scale": [2, 3], "texCoord": 1}}};
    /materials/0/emissiveFactor = [0.5, 0.25, 0];
    /materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength = 4;
    /materials/0/alphaMode = "BLEND")"));
  ASSERT_EQ(scene.images.size(), 1u);
  EXPECT_EQ(*scene.images[0].bytes, "\x89PNG\r\n\x1a\n");
  const Surface& surface = scene.surfaces[0];
  const Texture& texture = surface.textures[Surface::color_texture];
  EXPECT_EQ(texture.image, 0);
  EXPECT_EQ(texture.coordinates, 1);
  EXPECT_EQ(texture.wrap, (std::array{Texture::Wrap::mirrored, Texture::Wrap::clamped}));
  EXPECT_TRUE(texture.is_sharp_near);
  EXPECT_FALSE(texture.is_sharp_far);
  EXPECT_EQ(texture.levels, Texture::Levels::nearest);
  EXPECT_EQ(texture.uv_matrix * Eigen::Vector2d(1, 1) + texture.offset, Eigen::Vector2d(2.25, 3.5));
  EXPECT_EQ(surface.emission, (std::array{2.0, 1.0, 0.0}));
  EXPECT_EQ(surface.opacity, Surface::Opacity::blended);
  EXPECT_FALSE(surface.is_double_sided);
  EXPECT_EQ(surface.textures[Surface::normal_texture].image, -1);
}

TEST(LoadScene, ReadsImagesInFolderAlone) {
  const TemporaryFolder folder;
  folder.write("wood.png", "\x89PNG\r\n\x1a\n");
  const Json document = edited(R"(/images = [{"uri": "wood.png"}]; /textures = [{"source": 0}];
    /materials/0/pbrMetallicRoughness/baseColorTexture/index = 0)");
  const std::filesystem::path file = folder.write("scene.gltf", document.dump());
  const Scene scene = load_scene(file);
  ASSERT_EQ(scene.images.size(), 1u);
  EXPECT_THAT(scene.images[0].place, HasSubstr("scene.gltf: /images/0"));
  EXPECT_THAT(scene_files(file), Contains(std::filesystem::canonical(folder.path() / "wood.png")));
  EXPECT_THAT(complaint(edited(document, R"(/images/0/uri = "../wood.png")")),
              HasSubstr("leaves the scene's folder"));
  EXPECT_THAT(complaint(edited(document, R"(/images/0 = {"bufferView": 77})")),
              HasSubstr("/images/0/bufferView"));
  folder.write("wood.png", "\x89PNG\r\n\x1a\n.");
  EXPECT_NE(load_scene(file).hash, scene.hash);
}

TEST(LoadScene, FileWithoutPhysicsStandsStill) {
  const TemporaryFolder folder;
  EXPECT_FALSE(load_still_scene(folder.write("body.gltf", example().dump())));
  const Json document =
      edited(R"(/extensions =; /extensionsUsed =; /extensionsRequired =; /scenes =; /scene =;
    /nodes = [{"mesh": 0, "translation": [1, 2, 3]}])");
  const std::filesystem::path file = folder.write("mesh.gltf", document.dump());
  const std::optional<Scene> still = load_still_scene(file);
  ASSERT_TRUE(still);
  EXPECT_EQ(still->bodies.size(), 1u);
  ASSERT_EQ(still->visuals.size(), 1u);
  EXPECT_EQ(still->visuals[0].translation, Vector3(1, 2, 3));
  EXPECT_THAT(still->warnings, IsEmpty());
  // Loaded as a falling body, the mesh keeps its surface.
  const Scene falling = load_scene(file);
  ASSERT_EQ(falling.bodies.size(), 2u);
  EXPECT_EQ(falling.surfaces[static_cast<std::size_t>(falling.meshes[0].surface)].name,
            still->surfaces[static_cast<std::size_t>(still->meshes[0].surface)].name);
}

}  // namespace
}  // namespace substep
