/// Files that must be refused, each with a sentence that names the place and the trouble.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "sim/error.h"
#include "sim/math/base64.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using namespace test;

/// The example with one value set (or, where `value` is empty, removed), and parts of the message: the place,
/// which is the pointer where none is given, and the trouble.
struct Change {
  const char* name;
  const char* pointer;
  const char* value;
  const char* words;
  const char* place = nullptr;
};

void PrintTo(const Change& change, std::ostream* out) {
  *out << change.name;
}

class Refuses : public testing::TestWithParam<Change> {};

TEST_P(Refuses, AndSaysWhereAndWhy) {
  const Change& change = GetParam();
  json document = example();
  const json::json_pointer pointer(change.pointer);
  if (*change.value == '\0') {
    document.at(pointer.parent_pointer()).erase(pointer.back());
  } else {
    document[pointer] = json::parse(change.value);
  }
  const std::string said = complaint(document);
  EXPECT_THAT(said, HasSubstr("example.gltf: " +
                              std::string(change.place != nullptr ? change.place : change.pointer) + ": "));
  EXPECT_THAT(said, HasSubstr(change.words));
  EXPECT_EQ(said.find('\n'), std::string::npos);
}

#define PHYSICS "/extensions/KHR_physics_rigid_bodies"
#define SHAPES "/extensions/KHR_implicit_shapes/shapes"
#define CRATE "/nodes/1/extensions/KHR_physics_rigid_bodies"
#define HOOK "/nodes/2/extensions/KHR_physics_rigid_bodies/joint"
#define ROCK "/nodes/4/extensions/KHR_physics_rigid_bodies"
#define LIMIT "/extensions/KHR_physics_rigid_bodies/physicsJoints/0/limits/0"
#define DRIVE "/extensions/KHR_physics_rigid_bodies/physicsJoints/0/drives/0"

const auto name_of = [](const auto& info) { return std::string(info.param.name); };

INSTANTIATE_TEST_SUITE_P(
    Documents, Refuses,
    testing::Values(
        Change{"no_asset", "/asset", "", "has no 'asset'", "/"},
        Change{"old_version", "/asset/version", "\"1.0\"", "only glTF version 2 is read"},
        Change{"version_number", "/asset/version", "2.0", "must be a string, but is a number"},
        Change{"list_that_is_none", "/nodes", "{}", "must be an array"},
        Change{"item_that_is_none", "/nodes/0", "null", "must be an object, but is null"},
        Change{"scene_index", "/scene", "1", "there is no scene 1: the file has 1"},
        Change{"scene_negative", "/scene", "-1", "must be a whole number from 0, but is -1"},
        Change{"scene_fraction", "/scene", "0.5", "must be a whole number from 0, but is 0.5"},
        Change{"scene_text", "/scene", "\"0\"", "must be a whole number, but is a string"},
        Change{"scene_node", "/scenes/0/nodes/1", "99", "there is no node 99: the file has 8"},
        Change{"scene_of_no_root", "/scenes/0/nodes/1", "2", "node 2 is not a root"},
        Change{"child_index", "/nodes/1/children/0", "8", "there is no node 8"},
        Change{"child_huge", "/nodes/1/children/0", "18446744073709551615", "there is no node"},
        Change{"own_child", "/nodes/3/children", "[3]", "is its own ancestor", "/nodes/3"},
        Change{"cycle", "/nodes/2/children", "[1]", "is its own ancestor", "/nodes/1"},
        Change{"two_parents", "/nodes/3/children", "[2]", "node 2 has two parents", "/nodes/3/children/0"},
        Change{"child_twice", "/nodes/1/children", "[2, 2]", "node 2 has two parents", "/nodes/1/children/1"},
        Change{"translation_of_two", "/nodes/1/translation", "[1, 2]", "3 numbers"},
        Change{"translation_text", "/nodes/1/translation", "[1, \"x\", 2]",
               "must be a number, but is a string", "/nodes/1/translation/1"},
        Change{"translation_null", "/nodes/1/translation", "[1, null, 2]", "but is null",
               "/nodes/1/translation/1"},
        Change{"rotation_of_zero", "/nodes/1/rotation", "[0, 0, 0, 0]", "its length is 0"},
        Change{"rotation_too_long", "/nodes/1/rotation", "[0, 0, 0, 1.2]", "its length is 1.2"},
        Change{"rotation_overflow", "/nodes/1/rotation", "[0, 0, 0, 1e200]", "its length is inf"},
        Change{"scale_overflow", "/nodes/1/scale", "[1e308, 1e308, 1e308]", "too large or too small",
               CRATE "/motion"},
        Change{"matrix_short", "/nodes/3/matrix", "[1]", "has both 'matrix' and 'translation'", "/nodes/3"},
        Change{"matrix_row", "/nodes/0/matrix", "[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]",
               "last row must be 0 0 0 1"},
        Change{"matrix_sheared", "/nodes/0/matrix", "[1,0,0,0, 1,1,0,0, 0,0,1,0, 0,0,0,1]",
               "is sheared or flat", "/nodes/0" PHYSICS "/collider"},
        Change{"node_mesh", "/nodes/1/mesh", "3", "there is no mesh 3: the file has 1"},
        Change{"node_skin", "/nodes/1/skin", "0", "there is no skin 0: the file has 0"},
        Change{"node_camera", "/nodes/1/camera", "4", "there is no camera 4"},
        Change{"node_light", "/nodes/7/extensions/KHR_lights_punctual/light", "1", "there is no light 1"},
        Change{"name_number", "/nodes/1/name", "5", "must be a string"},
        Change{"field_of_view", "/cameras/0/perspective/yfov", "4", "less than pi"},
        Change{"color_of_light", "/extensions/KHR_lights_punctual/lights/0/color", "[1, -1, 0]", "negative"},
        Change{"color_of_material", "/materials/0/pbrMetallicRoughness/baseColorFactor", "[1, 0]",
               "4 numbers"},
        Change{"roughness", "/materials/0/pbrMetallicRoughness/roughnessFactor", "2", "between 0 and 1"},
        Change{"unknown_setting", "/extras", R"({"substep": {"gravitation": [0, 0, 0]}})",
               "unknown key 'gravitation'; known are gravity, duration, step, substeps, poster, gyroscopic",
               "/extras/substep"},
        Change{"gravity", "/extras", R"({"substep": {"gravity": -9.81}})", "3 numbers",
               "/extras/substep/gravity"},
        Change{"duration", "/scenes/0/extras", R"({"substep": {"duration": 0}})", "must be greater than 0",
               "/scenes/0/extras/substep/duration"},
        Change{"no_substeps", "/extras", R"({"substep": {"substeps": 0}})", "must be 1 or more",
               "/extras/substep/substeps"},
        Change{"half_a_substep", "/extras", R"({"substep": {"substeps": 0.5}})",
               "must be a whole number from 0, but is 0.5", "/extras/substep/substeps"},
        Change{"many_substeps", "/scenes/0/extras", R"({"substep": {"substeps": 100001}})",
               "is 100001, which is more than 100000", "/scenes/0/extras/substep/substeps"},
        Change{"step", "/extras", R"({"substep": {"step": -0.1}})", "must be greater than 0",
               "/extras/substep/step"},
        Change{"gyroscopic", "/extras", R"({"substep": {"gyroscopic": 1}})", "must be true or false",
               "/extras/substep/gyroscopic"},
        Change{"settings", "/extras", R"({"substep": []})", "must be an object", "/extras/substep"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Meshes, Refuses,
    testing::Values(
        Change{"buffer_index", "/bufferViews/0/buffer", "1", "there is no buffer 1"},
        Change{"buffer_short", "/buffers/0/byteLength", "1000", "says 1000 bytes, but there are only 168",
               "/buffers/0"},
        Change{"buffer_without_bytes", "/buffers/0/uri", "", "has no 'uri'", "/buffers/0"},
        Change{"view_too_long", "/bufferViews/1/byteLength", "73", "ends at byte 169", "/bufferViews/1"},
        Change{"view_offset", "/bufferViews/1/byteOffset", "1000000000000", "ends at byte", "/bufferViews/1"},
        Change{"stride_small", "/bufferViews/0/byteStride", "1", "have 12 bytes"},
        Change{"stride_large", "/bufferViews/0/byteStride", "16", "ends at byte 124", "/accessors/0"},
        Change{"stride_huge", "/bufferViews/0/byteStride", "4096", "more than 252"},
        Change{"accessor_view", "/accessors/0/bufferView", "2", "there is no buffer view 2"},
        Change{"accessor_without_view", "/accessors/0/bufferView", "", "has no 'bufferView'", "/accessors/0"},
        Change{"count_large", "/accessors/0/count", "9", "ends at byte 108", "/accessors/0"},
        Change{"count_huge", "/accessors/0/count", "4294967296", "more than"},
        Change{"count_zero", "/accessors/0/count", "0", "is 0"},
        Change{"offset", "/accessors/0/byteOffset", "2", "multiple of 4", "/accessors/0"},
        Change{"scalar_positions", "/accessors/0/type", "\"SCALAR\"", "must be VEC3"},
        Change{"byte_positions", "/accessors/0/componentType", "5120", "5120 (byte)"},
        Change{"unknown_component", "/accessors/0/componentType", "77", "77 (unknown)"},
        Change{"float_indices", "/accessors/1/componentType", "5126", "5126 (float)"},
        Change{"index_out_of_range", "/accessors/0/count", "7",
               "is out of range: the primitive has 7 vertices", "/meshes/0/primitives/0/indices"},
        Change{"no_whole_triangles", "/accessors/1/count", "35", "35 corners make no whole",
               "/meshes/0/primitives/0"},
        Change{"mode", "/meshes/0/primitives/0/mode", "77", "is 77, which is more than 6"},
        Change{"no_position", "/meshes/0/primitives/0/attributes/POSITION", "", "has no 'POSITION'",
               "/meshes/0/primitives/0/attributes"},
        Change{"position_index", "/meshes/0/primitives/0/attributes/POSITION", "5", "there is no accessor 5"},
        Change{"material_index", "/meshes/0/primitives/0/material", "5", "there is no material 5"},
        Change{"no_primitives", "/meshes/0/primitives", "", "has no 'primitives'", "/meshes/0"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Physics, Refuses,
    testing::Values(
        Change{"unknown_shape", SHAPES "/1/type", "\"torus\"", "unknown shape 'torus'"},
        Change{"two_shapes", SHAPES "/1/sphere", "{}", "is a box, but also has 'sphere'", SHAPES "/1"},
        Change{"flat_box", SHAPES "/1/box/size", "[1, 0, 1]", "greater than 0"},
        Change{"negative_radius", SHAPES "/1", R"({"type": "sphere", "sphere": {"radius": -1}})",
               "must be greater than 0, but is -1", SHAPES "/1/sphere/radius"},
        Change{"no_radius", SHAPES "/1",
               R"({"type": "cylinder", "cylinder": {"radiusTop": 0, "radiusBottom": 0}})",
               "radius 0 at both ends", SHAPES "/1/cylinder"},
        Change{"box_too_large", SHAPES "/1/box/size", "[1e200, 1e200, 1e200]", "too large or too small",
               CRATE "/motion"},
        Change{"box_too_small", SHAPES "/1/box/size", "[1e-200, 1e-200, 1e-200]", "too large or too small",
               CRATE "/motion"},
        Change{"shape_index", CRATE "/collider/geometry/shape", "2", "there is no implicit shape 2"},
        Change{"no_geometry", CRATE "/collider/geometry", "", "has no 'geometry'", CRATE "/collider"},
        Change{"two_geometries", CRATE "/collider/geometry/node", "1", "one of 'shape', 'node' and 'mesh'",
               CRATE "/collider/geometry"},
        Change{"geometry_node", ROCK "/collider/geometry/node", "50", "there is no node 50"},
        Change{"geometry_without_mesh", ROCK "/collider/geometry/node", "0", "has no mesh of triangles",
               ROCK "/collider"},
        Change{"hull_of_nothing", "/nodes/4/scale", "[1, 0, 1]", "thin", ROCK "/collider"},
        Change{"material", CRATE "/collider/physicsMaterial", "1", "there is no physics material 1"},
        Change{"filter", CRATE "/collider/collisionFilter", "1", "there is no collision filter 1"},
        Change{"both_filters", PHYSICS "/collisionFilters/0/collideWithSystems", "[]", "keep one",
               PHYSICS "/collisionFilters/0"},
        Change{"negative_friction", PHYSICS "/physicsMaterials/0/staticFriction", "-0.5",
               "must not be negative, but is -0.5"},
        Change{"restitution", PHYSICS "/physicsMaterials/0/restitution", "1.5", "must be at most 1"},
        Change{"combine", PHYSICS "/physicsMaterials/0/frictionCombine", "\"mean\"", "unknown 'mean'"},
        Change{"negative_mass", CRATE "/motion/mass", "-2", "must not be negative, but is -2"},
        Change{"mass_text", CRATE "/motion/mass", "\"heavy\"", "must be a number, but is a string"},
        Change{"mass_null", CRATE "/motion/mass", "null", "must be a number, but is null"},
        Change{"mass_too_small", CRATE "/motion/mass", "1e-320", "too large or too small", CRATE "/motion"},
        Change{"negative_inertia", CRATE "/motion/inertiaDiagonal", "[1, 1, -1]", "negative component"},
        Change{"inertia_orientation", CRATE "/motion/inertiaOrientation", "[1, 1, 1, 1]", "its length is 2"},
        Change{"kinematic", CRATE "/motion/isKinematic", "\"yes\"", "must be true or false"},
        Change{"trigger_node", CRATE "/trigger", R"({"nodes": [99]})", "there is no node 99",
               CRATE "/trigger/nodes/0"},
        Change{"trigger_geometry", CRATE "/trigger", "{}", "has no 'geometry'"},
        Change{"trigger_shape", CRATE "/trigger", R"({"geometry": {"shape": 5}})",
               "there is no implicit shape 5", CRATE "/trigger/geometry/shape"},
        Change{"plane_size", SHAPES "/0/plane", R"({"sizeX": 0})", "must be greater than 0",
               SHAPES "/0/plane/sizeX"},
        Change{"joint_to_missing_node", HOOK "/connectedNode", "12", "there is no node 12"},
        Change{"joint_without_other_end", HOOK "/connectedNode", "", "has no 'connectedNode'", HOOK},
        Change{"joint_description", HOOK "/joint", "1", "there is no physics joint 1"},
        Change{"limit_axes", LIMIT "/angularAxes", "[0]", "one of 'linearAxes' and 'angularAxes'", LIMIT},
        Change{"limit_axis", LIMIT "/linearAxes", "[0, 3]", "is 3, which is more than 2",
               LIMIT "/linearAxes/1"},
        Change{"limit_axis_twice", LIMIT "/linearAxes", "[0, 0]", "names axis 0 again",
               LIMIT "/linearAxes/1"},
        Change{"limit_no_axis", LIMIT "/linearAxes", "[]", "names no axis"},
        Change{"limit_reversed", LIMIT "/max", "-1", "has min 0 above max -1", LIMIT},
        Change{"limit_stiffness", LIMIT "/stiffness", "-1", "must not be negative"},
        Change{"drive_type", DRIVE "/type", "\"spherical\"", "must be 'linear' or 'angular'"},
        Change{"drive_axis", DRIVE "/axis", "3", "is 3, which is more than 2"},
        Change{"drive_force", DRIVE "/maxForce", "-3", "must not be negative"}),
    name_of);

TEST(Refusal, RefusesJointWithinWorld) {
  json document = example();
  document["nodes"][3]["extensions"]["KHR_physics_rigid_bodies"]["joint"] = {{"connectedNode", 0},
                                                                             {"joint", 0}};
  EXPECT_THAT(complaint(document), HasSubstr("joins two nodes of which neither belongs to a body"));
}

TEST(Refusal, RefusesMoreThan64Systems) {
  json document = example();
  json& systems =
      document["extensions"]["KHR_physics_rigid_bodies"]["collisionFilters"][0]["collisionSystems"];
  for (int i = 0; i < 70; ++i) systems.push_back("system " + std::to_string(i));
  EXPECT_THAT(complaint(document), HasSubstr("more than 64 collision systems"));
}

TEST(Refusal, RefusesOverflowingScales) {
  json document = example();
  json& nodes = document["nodes"];
  nodes[3]["scale"] = {1e200, 1, 1};
  nodes[3]["children"] = {8};
  nodes.push_back({{"scale", {1e200, 1, 1}}});
  EXPECT_THAT(complaint(document), HasSubstr("/nodes/8: its transform overflows"));
}

TEST(Refusal, RefusesNumbersBeyondDouble) {
  std::string text = example().dump();
  text.replace(text.find("\"mass\":2"), 8, "\"mass\":1e999");
  const TemporaryFolder folder;
  EXPECT_THAT(complaint(folder.write("example.gltf", text)),
              AllOf(HasSubstr("not valid JSON"), HasSubstr("1e999")));
}

TEST(Refusal, RefusesVerticesNotFinite) {
  for (const char* bits : {"\x00\x00\xc0\x7f", "\x00\x00\x80\x7f", "\x00\x00\x80\xff"}) {  // NaN, ∞, −∞
    std::string buffer = cube_buffer();
    buffer.replace(12 * 3 + 4, 4, std::string(bits, 4));
    json document = example();
    document["buffers"][0]["uri"] = "data:application/gltf-buffer;base64," + base64(buffer);
    EXPECT_THAT(complaint(document), HasSubstr("/meshes/0/primitives/0: vertex 3 is not finite"));
  }
}

TEST(Refusal, RefusesUrisOutsideFolder) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "inner");
  folder.write("outside.bin", cube_buffer());
  std::filesystem::create_symlink(folder.path() / "outside.bin", folder.path() / "inner/link.bin");
  std::filesystem::create_directories(folder.path() / "inner/folder");
  const std::pair<const char*, const char*> cases[]{
      {"../outside.bin", "leaves the scene's folder"},
      {"%2e%2e/outside.bin", "leaves the scene's folder"},
      {"folder/../../outside.bin", "leaves the scene's folder"},
      {"../../../../../../../../etc/passwd", "leaves the scene's folder"},
      {"/etc/passwd", "leaves the scene's folder"},
      {"link.bin", "leaves the scene's folder"},
      {"missing.bin", "there is no file 'missing.bin' beside the scene"},
      {"folder", "is not a regular file"},
      {"", "is empty"},
      {"%", "two hexadecimal digits"},
      {"a%2", "two hexadecimal digits"},
      {"a%zz", "two hexadecimal digits"},
      {"a%00b", "control character"},
      {"https://example.org/cube.bin", "network address"},
      {"data:application/octet-stream;base64", "without a comma"},
      {"data:text/plain,hello", "not base64"},
      {"data:application/octet-stream;base64,AA AA", "not base64 (code 32)"},
      {"data:application/octet-stream;base64,AAAA", "there are only 3"}};
  for (const auto& [uri, words] : cases) {
    json document = example();
    document["buffers"][0]["uri"] = uri;
    EXPECT_THAT(complaint(folder.write("inner/scene.gltf", document.dump())), HasSubstr(words)) << uri;
  }
}

TEST(Refusal, RefusesOtherFiles) {
  const TemporaryFolder folder;
  EXPECT_THAT(complaint(folder.path() / "missing.gltf"), EndsWith("missing.gltf: there is no such file"));
  std::filesystem::create_directories(folder.path() / "folder.gltf");
  EXPECT_THAT(complaint(folder.path() / "folder.gltf"), EndsWith("folder.gltf: is not a regular file"));
  EXPECT_THAT(complaint(std::filesystem::path("/dev/zero")), EndsWith("/dev/zero: is not a regular file"));
  EXPECT_THAT(complaint(folder.write("empty.gltf", "")), EndsWith("empty.gltf: is empty"));
  EXPECT_THAT(complaint(folder.write("empty.glb", "")), EndsWith("empty.glb: is empty"));
  EXPECT_THAT(complaint(folder.write("blank.gltf", " \n ")), EndsWith("blank.gltf: is empty"));
  EXPECT_THAT(complaint(folder.write("scene.txt", "hello")), HasSubstr("is neither a scene"));
  EXPECT_THAT(complaint(folder.path() / "missing.txt"), EndsWith("missing.txt: there is no such file"));
  EXPECT_THAT(complaint(folder.path() / "missing.obj"), EndsWith("missing.obj: there is no such file"));
  EXPECT_THAT(complaint(folder.write("text.gltf", "hello")),
              HasSubstr("is not valid JSON: parse error at line 1"));
  EXPECT_THAT(complaint(folder.write("number.gltf", "1")), HasSubstr("not an object"));
  EXPECT_THAT(complaint(folder.write("bytes.gltf", "{\"asset\": \"\xff\"}")), HasSubstr("is not valid JSON"));
  EXPECT_THAT(complaint(folder.write("nan.gltf", "{\"asset\": NaN}")), HasSubstr("is not valid JSON"));
  const std::string deep = "{\"extras\": " + std::string(100'000, '[') + std::string(100'000, ']') + "}";
  EXPECT_THAT(complaint(folder.write("deep.gltf", deep)), HasSubstr("nested deeper than 64 levels at byte"));
}

class Glb : public testing::Test {
 protected:
  Glb() {
    json document = example();
    document["buffers"][0].erase("uri");
    bytes_ = glb(document.dump(), cube_buffer());
  }

  std::string complaint_about(const std::string& bytes) const {
    return complaint(folder_.write("scene.glb", bytes));
  }
  std::string with(std::size_t offset, const std::string& replacement) const {
    std::string bytes = bytes_;
    return bytes.replace(offset, replacement.size(), replacement);
  }

  TemporaryFolder folder_;
  std::string bytes_;
};

TEST_F(Glb, RefusesEveryTruncation) {
  for (std::size_t length = 1; length < bytes_.size(); length += length < 40 ? 1 : 97) {
    EXPECT_THAT(complaint_about(bytes_.substr(0, length)), HasSubstr("scene.glb: ")) << length;
    EXPECT_THAT(complaint_about(bytes_.substr(0, length)), HasSubstr("cut short")) << length;
  }
  EXPECT_THAT(complaint_about(bytes_ + "x"), HasSubstr("the file is damaged"));
}

TEST_F(Glb, RefusesDamagedHeader) {
  EXPECT_THAT(complaint_about(with(0, "flTG")), HasSubstr("does not begin with 'glTF'"));
  EXPECT_THAT(complaint_about(with(4, "\x01")), HasSubstr("is of glTF version 1"));
  EXPECT_THAT(complaint_about(with(8, "\xff\xff\xff\xff")), HasSubstr("its header says 4294967295 bytes"));
  EXPECT_THAT(complaint_about(with(12, "\xff\xff\xff\xff")), HasSubstr("chunk 0 says 4294967295 bytes"));
  EXPECT_THAT(complaint_about(with(12, std::string(4, '\0'))), HasSubstr("scene.glb: "));
  EXPECT_THAT(complaint_about(with(16, "JSOM")), HasSubstr("its first chunk is not the JSON chunk"));
  const std::size_t binary = bytes_.size() - 168 - 8;
  EXPECT_THAT(complaint_about(with(binary, "\xff\xff\xff\x7f")), HasSubstr("chunk 1 says 2147483647 bytes"));
  EXPECT_THAT(complaint_about(with(binary + 4, "BOX")), HasSubstr("/buffers/0: has no 'uri'"));
}

TEST_F(Glb, RefusesFileWithoutChunks) {
  EXPECT_THAT(complaint_about(std::string("glTF\2\0\0\0\x0c\0\0\0", 12)), HasSubstr("has no JSON chunk"));
  EXPECT_THAT(complaint_about(std::string("glTF\2\0\0\0\x10\0\0\0\0\0\0\0", 16)),
              HasSubstr("chunk 0 has no whole header"));
}

}  // namespace
}  // namespace substep
