// Tests meshes in other formats: bodies with the right mass, and damaged files that are refused in time.
// This is one file, since valid and damaged meshes share their texts.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "sim/loading/collider_shapes.h"
#include "sim/loading/load_scene.h"
#include "tests/error_message.h"
#include "tests/folders.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;
using namespace test;

const std::filesystem::path meshes = std::filesystem::path(test::source_folder) / "tests/scene/meshes";

// A cube of 2 m with its lowest corner at the origin.
const char* const cube_obj =
    "o cube\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

std::string with(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  if (at == std::string::npos) throw std::logic_error("not in the text: " + what);
  return text.replace(at, what.size(), by);
}

Scene load_text(const std::string& name, const std::string& text, const MeshOptions& options = {}) {
  const TemporaryFolder folder;
  return load_scene(folder.write(name, text), options);
}

const char* const outward_faces =
    "f -5 -6 -7 -8\nf -4 -3 -2 -1\nf -8 -7 -3 -4\nf -7 -6 -2 -3\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n";
const char* const inward_faces =
    "f -8 -7 -6 -5\nf -1 -2 -3 -4\nf -4 -3 -7 -8\nf -3 -2 -6 -7\nf -2 -1 -5 -6\nf -1 -4 -8 -5\n";

/// Returns a cube of 1 m from (x, y, 0.5), in a new `object` or as a part of the object before it.
std::string small_cube(double x, double y, const char* faces, const char* object = "") {
  std::string text = object;
  for (const double z : {0.5, 1.5}) {
    text +=
        fmt::format("v {0} {2} {4}\nv {1} {2} {4}\nv {1} {3} {4}\nv {0} {3} {4}\n", x, x + 1, y, y + 1, z);
  }
  return text + faces;
}

/// Returns a COLLADA file with the tetrahedron "g" between the origin and 1 m of each axis, and nodes.
std::string dae(const std::string& nodes) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.01"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 100 0 0 0 100 0 0 0 100</float_array><technique_common>
<accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v">
<input semantic="POSITION" source="#p"/></vertices><triangles count="4">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s">)" +
         nodes +
         R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST(MeshScene, ClosedMeshHasExactMass) {
  const Scene scene = load_text("cube.obj", cube_obj);
  EXPECT_THAT(scene.warnings, IsEmpty());
  ASSERT_EQ(scene.bodies.size(), 2u);
  const Body& cube = scene.bodies[1];
  EXPECT_EQ(cube.name, "cube");
  EXPECT_NEAR(1 / cube.inverse_mass, 8000, 1e-9);  // measured 0
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(1 / cube.inverse_inertia[axis], 8000 * 4 / 6., 1e-9);  // measured 9e-13
  }
  // The cube starts half its size above the plane, in the middle.
  EXPECT_LE((cube.pose.position - Vector3(0, 2, 0)).norm(), 1e-12);  // measured 0
  ASSERT_EQ(scene.colliders.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<Plane>(scene.colliders[0].shape));
  EXPECT_EQ(std::get<Polytope>(scene.colliders[1].shape).vertices.size(), 8u);
}

TEST(MeshScene, InsideOutMeshIsSameBody) {
  const char* const reversed = "f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
  const std::string text = cube_obj;
  const Scene scene = load_text("cube.obj", text.substr(0, text.find("f ")) + reversed);
  EXPECT_THAT(scene.warnings, IsEmpty());
  EXPECT_NEAR(1 / scene.bodies[1].inverse_mass, 8000, 1e-9);
}

TEST(MeshScene, OpenMeshTakesHullWithWarning) {
  const Scene scene = load_text("cube.obj", with(cube_obj, "f 4 1 5 8\n", ""));
  EXPECT_THAT(scene.warnings, Contains(HasSubstr("mesh 'cube': is not closed")));
  EXPECT_NEAR(1 / scene.bodies[1].inverse_mass, 8000, 1e-9);
}

TEST(MeshScene, SharedEdgeTakesHullWithWarning) {
  const Scene scene =
      load_text("two.obj", small_cube(0, 0, outward_faces, "o two\n") + small_cube(1, 1, outward_faces));
  EXPECT_THAT(scene.warnings, ElementsAre(HasSubstr("or more than two triangles share an edge")));
}

/// A part that faces inwards is a cavity inside another part; beside it the mesh has the mass of its hull.
TEST(MeshScene, InwardPartIsCavityOrTakesHull) {
  const Scene hollow = load_text("cube.obj", cube_obj + small_cube(0.5, 0.5, inward_faces));
  EXPECT_NEAR(1 / hollow.bodies[1].inverse_mass, 7000, 1e-9);  // measured 9e-13
  const Scene beside = load_text("cube.obj", cube_obj + small_cube(2.5, 0.5, inward_faces));
  EXPECT_THAT(beside.warnings, Contains(HasSubstr("or has parts that face inwards")));
  // The hull is the cube and a frustum 1.5 m long, with faces of 4 m² and 1 m².
  EXPECT_NEAR(1 / beside.bodies[1].inverse_mass, 8000 + 3500, 1e-9);  // measured 2e-12
}

TEST(MeshScene, LeavesFlatMeshOut) {
  const std::string floor = "o floor\nv 0 0 0\nv 0 0 9\nv 9 0 9\nv 9 0 0\nf -4 -3 -2 -1\n";
  const Scene scene = load_text("cube.obj", floor + small_cube(0, 0, outward_faces, "o cube\n"));
  ASSERT_EQ(scene.bodies.size(), 2u);
  EXPECT_EQ(scene.bodies[1].name, "cube");
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_THAT(scene.warnings, ElementsAre(AllOf(StartsWith("mesh 'floor': its convex hull is thinner"),
                                                EndsWith("left out"))));
  EXPECT_THAT(message_of([&] { load_text("floor.obj", floor); }),
              HasSubstr("floor.obj: mesh 'floor': its convex hull is thinner"));
}

/// AMF states a unit that assimp drops.
TEST(MeshScene, WarnsOfIgnoredUnit) {
  const std::string amf =
      R"(<?xml version="1.0"?><amf unit="millimeter"><object id="0"><mesh><vertices>
<vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex>
<vertex><coordinates><x>15</x><y>0</y><z>0</z></coordinates></vertex>
<vertex><coordinates><x>0</x><y>15</y><z>0</z></coordinates></vertex>
<vertex><coordinates><x>0</x><y>0</y><z>15</z></coordinates></vertex></vertices><volume>
<triangle><v1>0</v1><v2>2</v2><v3>1</v3></triangle><triangle><v1>0</v1><v2>1</v2><v3>3</v3></triangle>
<triangle><v1>0</v1><v2>3</v2><v3>2</v3></triangle><triangle><v1>1</v1><v2>2</v2><v3>3</v3></triangle>
</volume></mesh></object></amf>)";
  EXPECT_THAT(load_text("t.amf", amf).warnings, ElementsAre(HasSubstr("its unit, which is not read,")));
  MeshOptions millimetres;
  millimetres.scale = 0.001;
  EXPECT_THAT(load_text("t.amf", amf, millimetres).warnings, IsEmpty());
}

TEST(MeshScene, OptionsSetSizeMassPoseAndCopies) {
  MeshOptions options;
  options.scale = 0.5;
  options.mass = 3;
  options.height = 7;
  options.rotation = {90, 0, 0};
  options.copies = 6;
  const Scene scene = load_text("cube.obj", cube_obj, options);
  ASSERT_EQ(scene.bodies.size(), 7u);
  const Body& first = scene.bodies[1];
  EXPECT_NEAR(1 / first.inverse_mass, 3, 1e-12);
  EXPECT_NEAR(1 / first.inverse_inertia.x(), 0.5, 1e-12);
  EXPECT_NEAR(first.pose.position.y(), 7.5, 1e-12);
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(std::fabs((first.pose * first.body_from_node).orientation.x()), half, 1e-12);
  EXPECT_EQ(scene.bodies[6].name, "cube copy 6");
  // Copies do not overlap: their centres are at least a diagonal of the base, or a layer, from each other.
  for (std::size_t i = 1; i < 7; ++i) {
    for (std::size_t k = 1; k < i; ++k) {
      const Vector3 offset = scene.bodies[i].pose.position - scene.bodies[k].pose.position;
      EXPECT_TRUE(std::hypot(offset.x(), offset.z()) > std::sqrt(2) || std::fabs(offset.y()) > 1);
    }
  }
  EXPECT_NE(scene.hash, load_text("cube.obj", cube_obj).hash);
}

TEST(SymmetricPrincipalInertia, RemovesRoundingErrors) {
  for (int odd = 0; odd < 3; ++odd) {
    Matrix3 inertia = Vector3(2, 2, 2).asDiagonal();
    inertia(odd, odd) = 5;
    inertia((odd + 1) % 3, (odd + 1) % 3) += 4e-16;
    inertia(0, 2) = inertia(2, 0) = 1e-13;
    const PrincipalInertia principal = symmetric_principal_inertia(inertia);
    EXPECT_EQ(principal.moments[odd], 5);
    EXPECT_EQ(principal.moments[(odd + 1) % 3], principal.moments[(odd + 2) % 3]);
    EXPECT_NEAR(principal.moments[(odd + 1) % 3], 2, 1e-15);
    EXPECT_EQ(principal.orientation.coeffs(), Quaternion::Identity().coeffs());
  }
}

TEST(MeshScene, RefusesOptionsOutOfRange) {
  const std::vector<std::pair<const char*, std::function<void(MeshOptions&)>>> cases{
      {"cube.obj: the scale must be above 0", [](auto& o) { o.scale = 0; }},
      {"the density must be above 0", [](auto& o) { o.density = std::nan(""); }},
      {"the mass must be above 0", [](auto& o) { o.mass = -1; }},
      {"the height must be from 0 to 100000 m, but is -1", [](auto& o) { o.height = -1; }},
      {"the copies must be from 1 to 1000", [](auto& o) { o.copies = 1001; }},
      {"within ±360 degrees",
       [](auto& o) {
         o.rotation = {0, 400, 0};
       }},
      {"cube.obj: ", [](auto& o) { o.scale = 1e-200; }}};
  for (const auto& [words, change] : cases) {
    MeshOptions options;
    change(options);
    EXPECT_THAT(message_of([&] { load_text("cube.obj", cube_obj, options); }), HasSubstr(words));
  }
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.write("example.gltf", example().dump());
  EXPECT_THAT(message_of([&] { load_scene(file, MeshOptions{}); }), HasSubstr("is a scene"));
}

TEST(MeshScene, ObjectsBecomeBodiesAndMaterialsColours) {
  const TemporaryFolder folder;
  folder.write("red.mtl", "newmtl red\nKd 1 0 0\n");
  // Faces of the other cube count its vertices from the last one.
  std::string other = with(cube_obj, "o cube", "o other");
  other.replace(other.find("f "), std::string::npos, outward_faces);
  const Scene scene = load_scene(
      folder.write("two.obj", "mtllib away/red.mtl\nusemtl red\n" + std::string(cube_obj) + other));
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.bodies[1].name, "cube");
  EXPECT_EQ(scene.bodies[2].name, "other");
  ASSERT_FALSE(scene.surfaces.empty());
  EXPECT_EQ(scene.surfaces[0].base_color, (std::array{1., 0., 0.}));
  EXPECT_THAT(scene.warnings, IsEmpty());
}

TEST(MeshScene, ReadsStlPlyAndCollada) {
  MeshOptions millimetres;
  millimetres.scale = 0.001;
  const Scene gear = load_scene(meshes / "gear.stl", millimetres);
  ASSERT_EQ(gear.bodies.size(), 2u);
  // Its generator knows the volume.
  EXPECT_NEAR(1 / gear.bodies[1].inverse_mass, 1000 * 92208.82866445865e-9, 1e-7);
  EXPECT_THAT(gear.warnings, Contains(HasSubstr("collides as its convex hull")));

  const Scene solid = load_scene(meshes / "dodecahedron.ply");
  EXPECT_THAT(solid.warnings, IsEmpty());
  const double edge = 0.6 / std::numbers::phi;
  EXPECT_NEAR(1 / solid.bodies[1].inverse_mass, 1000 * (15 + 7 * std::sqrt(5)) / 4 * edge * edge * edge,
              1e-4);
  EXPECT_EQ(std::get<Polytope>(solid.colliders[1].shape).face_count(), 12u);

  // The file has centimetres and z up: a tetrahedron with edges of 1 m along the axes.
  const Scene tetrahedron = load_text("t.dae", dae("<node><instance_geometry url=\"#g\"/></node>"));
  EXPECT_NEAR(1 / tetrahedron.bodies[1].inverse_mass, 1000 / 6., 1e-4);  // measured 2e-6
}

Json without_physics() {
  return edited(R"(/extensions =; /extensionsUsed =; /extensionsRequired =; /scenes = [{"nodes": [0, 1]}];
    /nodes = [{"name": "left", "mesh": 0, "translation": [-2, 5, 0]},
              {"name": "right", "mesh": 0, "scale": [2, 1, -1]}])");
}

TEST(MeshScene, GltfWithoutPhysicsFalls) {
  const Scene scene = load_text("plain.gltf", edited(without_physics(), "/animations = []").dump());
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.bodies[1].name, "left");
  EXPECT_NEAR(1 / scene.bodies[1].inverse_mass, 1000, 1e-9);
  EXPECT_NEAR(1 / scene.bodies[2].inverse_mass, 2000, 1e-9);  // mirrored, and no thinner for it
  EXPECT_NEAR(scene.bodies[1].pose.position.y() - scene.bodies[2].pose.position.y(), 5, 1e-12);
  EXPECT_THAT(scene.warnings,
              Contains(HasSubstr("its meshes fall as bodies on a plane, without its cameras")));
  EXPECT_THAT(scene.warnings, Contains(HasSubstr("animations: are ignored")));
  MeshOptions options;
  options.mass = 3;
  EXPECT_NEAR(1 / load_text("plain.gltf", without_physics().dump(), options).bodies[1].inverse_mass, 3,
              1e-12);
}

TEST(MeshScene, IgnoresOtherExtensions) {
  const Json document = edited(without_physics(), R"(/extensionsUsed = ["KHR_lights_punctual"];
    /extensions/KHR_lights_punctual/lights = [{"type": "point"}];
    /nodes/1/extensions/KHR_lights_punctual/light = 0)");
  const Scene scene = load_text("lit.gltf", document.dump());
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_NEAR(1 / scene.bodies[1].inverse_mass, 1000, 1e-9);
}

TEST(MeshScene, SkinnedMeshFollowsItsJoints) {
  const Json document = edited(skinned(without_physics(), 0, "[2, 2]"),
                               R"(/nodes/2 = {"name": "joint", "translation": [7, 8, 9], "scale": [3, 1, 1]};
    /scenes/0/nodes = [0, 1, 2])");
  const Scene scene = load_text("skinned.gltf", document.dump());
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_NEAR(1 / scene.bodies[1].inverse_mass, 3000, 1e-9);
  // The other node lies at 0 0 0, and its mesh follows no joint. All bodies are lifted equally.
  const Vector3 apart = scene.bodies[1].pose.position - scene.bodies[2].pose.position;
  EXPECT_NEAR((apart - Vector3(7, 8, 9)).norm(), 0, 1e-12);  // measured 0
}

TEST(MeshScene, TangentsTurnWithTheirMesh) {
  Json document = without_physics();
  std::string bytes = cube_buffer();
  std::string tangents;
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<float, 4> tangent{0.6F, 0, 0.8F, 1};
    tangents.append(reinterpret_cast<const char*>(tangent.data()), sizeof tangent);
  }
  Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
  attributes["NORMAL"] = attributes["POSITION"];
  attributes["TANGENT"] = add_accessor(document, bytes, tangents, 5126, "VEC4");
  document["nodes"][0]["rotation"] = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};  // x goes to y
  const Scene scene = load_text("tangents.gltf", document.dump());
  ASSERT_EQ(scene.visuals.size(), 2u);
  const std::vector<std::array<float, 4>> expected{
      {0, 0.6F, 0.8F, 1},                                           // turned
      {1.2F / std::sqrt(2.08F), 0, -0.8F / std::sqrt(2.08F), -1}};  // scaled by 2, 1, −1
  for (std::size_t i = 0; i < 2; ++i) {
    const Visual& visual = scene.visuals[i];
    const Mesh& mesh = scene.meshes[visual.mesh];
    ASSERT_FALSE(mesh.attributes.tangents.empty());
    for (const std::array<float, 4>& tangent : mesh.attributes.tangents) {
      const Vector3 drawn = scene.bodies[visual.body].pose.orientation *
                            (visual.linear * Vector3(tangent[0], tangent[1], tangent[2]));
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(drawn[k], expected[i][k], 2e-7);  // measured 6e-8
      EXPECT_EQ(tangent[3], expected[i][3]);
    }
  }
}

TEST(MeshScene, ReadsExtensionsInCapitals) {
  EXPECT_EQ(load_text("CUBE.OBJ", cube_obj).bodies.size(), 2u);
  const TemporaryFolder folder;
  EXPECT_EQ(load_scene(folder.write("EXAMPLE.GLTF", example().dump())).joints.size(), 1u);
}

TEST(MeshScene, RefusesMeshSharedTooOften) {
  Json document = without_physics();
  for (int i = 2; i < 1001; ++i) {
    document["nodes"].push_back({{"mesh", 0}});
    document["scenes"][0]["nodes"].push_back(i);
  }
  EXPECT_THAT(complaint(document), HasSubstr("/nodes/1000"));
  EXPECT_THAT(complaint(document), HasSubstr("more than 1000"));
}

TEST(MeshScene, KnotIsDrawnSmoothAndInItsColour) {
  const Scene knot = load_scene(meshes / "knot.obj");
  EXPECT_NEAR(1 / knot.bodies[1].inverse_mass, 404.92, 0.05);
  ASSERT_EQ(knot.surfaces.size(), 1u);
  EXPECT_GT(knot.surfaces[0].base_color[0], knot.surfaces[0].base_color[2]);
  ASSERT_EQ(knot.meshes.size(), 1u);
  const Mesh& mesh = knot.meshes[0];
  int bent = 0;
  for (const Triangle& triangle : mesh.triangles) {
    bent += (mesh.normals[triangle[0]] - mesh.normals[triangle[1]]).norm() > 1e-3;
  }
  EXPECT_GT(bent, static_cast<int>(mesh.triangles.size()) / 2);
  // The cube keeps its edges.
  const Scene cube = load_text("cube.obj", cube_obj);
  for (const Vector3& normal : cube.meshes[0].normals) EXPECT_NEAR(normal.cwiseAbs().maxCoeff(), 1, 1e-12);
}

struct Hostile {
  const char* name;
  std::string file;
  std::string bytes;
};

void PrintTo(const Hostile& hostile, std::ostream* out) {
  *out << hostile.name;
}

std::string repeated(const std::string& text, int count) {
  std::string result;
  for (int i = 0; i < count; ++i) result += text;
  return result;
}

/// Returns files that could take long; other hostile ones are in the fuzzer's corpus.
std::vector<Hostile> hostile_meshes() {
  std::string objects;
  for (int i = 0; i < 2000; ++i) objects += with(cube_obj, "o cube", "o cube" + std::to_string(i));
  std::string bomb;
  for (int level = 0; level < 40; ++level) {
    const std::string next = "<instance_node url=\"#n" + std::to_string(level + 1) + "\"/>";
    bomb += "<node id=\"n" + std::to_string(level) + "\">" + next + next + "</node>";
  }
  bomb += "<node id=\"n40\"><instance_geometry url=\"#g\"/></node>";
  const std::string deep =
      repeated("<node>", 60'000) + "<instance_geometry url=\"#g\"/>" + repeated("</node>", 60'000);
  return {{"many_objects", "a.obj", objects},
          {"long_line", "a.obj", "v " + repeated("0 ", 100'000) + "\nf 1 2 3\n"},
          {"long_face", "a.obj", std::string(cube_obj) + "f" + repeated(" 9", 200'000) + "\n"},
          {"no_end", "a.stl", "solid " + repeated("facet normal 0 0 1 ", 20'000)},
          {"instances_of_instances", "a.dae", dae(bomb)},
          {"deep", "a.dae", dae(deep)}};
}

class HostileMesh : public testing::TestWithParam<Hostile> {};

TEST_P(HostileMesh, LoadsOrIsRefusedInTime) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.write(GetParam().file, GetParam().bytes);
  ASSERT_LT(GetParam().bytes.size(), std::size_t{1} << 20);
  const Outcome outcome = outcome_of(file);
  EXPECT_LT(outcome.seconds, 2);
  if (!outcome.message.empty()) {
    EXPECT_THAT(outcome.message, HasSubstr(file.string() + ": "));
  }
  EXPECT_EQ(outcome.message.find('\n'), std::string::npos) << outcome.message;
}

INSTANTIATE_TEST_SUITE_P(Files, HostileMesh, testing::ValuesIn(hostile_meshes()),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(HostileMeshes, ReadNoFileOutsideFolder) {
  const TemporaryFolder folder;
  folder.write("outside.mtl", "newmtl red\nKd 1 0 0\n");
  std::filesystem::create_directories(folder.path() / "inner");
  std::filesystem::create_symlink(folder.path() / "outside.mtl", folder.path() / "inner/link.mtl");
  const std::string absolute = (folder.path() / "outside.mtl").string();
  for (const std::string& name : std::vector<std::string>{"../outside.mtl", "link.mtl", absolute}) {
    const Scene scene = load_scene(
        folder.write("inner/cube.obj", "mtllib " + name + "\nusemtl red\n" + std::string(cube_obj)));
    for (const Surface& surface : scene.surfaces)
      EXPECT_NE(surface.base_color, (std::array{1., 0., 0.})) << name;
    EXPECT_THAT(scene.warnings, ElementsAre(HasSubstr("material file '" + name + "' is empty or not")));
  }
}

}  // namespace
}  // namespace substep
