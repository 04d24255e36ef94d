/// Files that are refused with a message that names the place and the fault, and features of glTF that are
/// replaced with a warning. One file, since all rows edit one example.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "sim/math/base64.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using namespace test;

/// Expects a refusal for each row: an edit of the example | words of the message | the JSON pointer that it
/// names (without one: the edit's).
void expect_refusals(const std::string& table) {
  for (const auto& row : rows(table)) {
    SCOPED_TRACE(row[0]);
    const std::string place = row.size() > 2 ? row[2] : row[0].substr(0, row[0].find(" ="));
    const std::string message = complaint(edited(row[0]));
    EXPECT_THAT(message, HasSubstr("example.gltf: " + pointer(place) + ": "));
    EXPECT_THAT(message, HasSubstr(row[1]));
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

TEST(Refusal, RefusesDocuments) {
  expect_refusals(R"(
    /asset = | has no 'asset' | /
    /asset/version = "1.0" | only glTF version 2 is read
    /asset/version = 2.0 | must be a string, but is a number
    /extensionsRequired/- = "KHR_something_else" | which is not read | /extensionsRequired/2
    /nodes = {} | must be an array
    /nodes/0 = null | must be an object, but is null
    /scene = 1 | there is no scene 1: the file has 1
    /scene = -1 | must be a whole number from 0, but is -1
    /scene = 0.5 | must be a whole number from 0, but is 0.5
    /scene = "0" | must be a whole number, but is a string
    /scenes/0/nodes/1 = 99 | there is no node 99: the file has 8
    /scenes/0/nodes/1 = 2 | node 2 is not a root
    /nodes/1/children/0 = 8 | there is no node 8
    /nodes/1/children/0 = 18446744073709551615 | there is no node
    /nodes/3/children = [3] | is its own ancestor | /nodes/3
    /nodes/2/children = [1] | is its own ancestor | /nodes/1
    /nodes/3/children = [2] | node 2 has two parents | /nodes/3/children/0
    /nodes/1/children = [2, 2] | node 2 has two parents | /nodes/1/children/1
    /nodes/1/translation = [1, 2] | 3 numbers
    /nodes/1/translation = [1, "x", 2] | must be a number, but is a string | /nodes/1/translation/1
    /nodes/1/translation = [1, null, 2] | but is null | /nodes/1/translation/1
    /nodes/1/rotation = [0, 0, 0, 0] | its length is 0
    /nodes/1/rotation = [0, 0, 0, 1.2] | its length is 1.2
    /nodes/1/rotation = [0, 0, 0, 1e200] | its length is inf
    /nodes/1/scale = [1e308, 1e308, 1e308] | too large or too small | /nodes/1/$/motion
    /nodes/3/scale = [1e200, 1, 1]; /nodes/3/children = [8]; /nodes/- = {"scale": [1e200, 1, 1]} |
        its transform overflows | /nodes/8
    /nodes/3/matrix = [1] | has both 'matrix' and 'translation' | /nodes/3
    /nodes/0/matrix = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2] | last row must be 0 0 0 1
    /nodes/0/matrix = [1,0,0,0, 1,1,0,0, 0,0,1,0, 0,0,0,1] | is sheared or flat | /nodes/0/$/collider
    /nodes/1/mesh = 3 | there is no mesh 3: the file has 1
    /nodes/1/skin = 0 | there is no skin 0: the file has 0
    /nodes/1/camera = 4 | there is no camera 4
    /nodes/7/extensions/KHR_lights_punctual/light = 1 | there is no light 1
    /nodes/1/name = 5 | must be a string
    /cameras/0/perspective/yfov = 4 | less than pi
    /extensions/KHR_lights_punctual/lights/0/color = [1, -1, 0] | negative
    /materials/0/pbrMetallicRoughness/baseColorFactor = [1, 0] | 4 numbers
    /materials/0/pbrMetallicRoughness/roughnessFactor = 2 | between 0 and 1
    /extras/substep/gravitation = [0, 0, 0] |
        unknown key 'gravitation'; known are gravity, duration, | /extras/substep
    /extras/substep/gravity = -9.81 | 3 numbers
    /scenes/0/extras/substep/duration = 0 | must be greater than 0
    /extras/substep/substeps = 0 | must be 1 or more
    /extras/substep/substeps = 0.5 | must be a whole number from 0, but is 0.5
    /scenes/0/extras/substep/substeps = 100001 | is 100001, which is more than 100000
    /extras/substep/step = -0.1 | must be greater than 0
    /extras/substep/gyroscopic = 1 | must be true or false
    /extras/substep = [] | must be an object
)");
}

TEST(Refusal, RefusesMeshes) {
  expect_refusals(R"(
    /bufferViews/0/buffer = 1 | there is no buffer 1
    /buffers/0/byteLength = 1000 | says 1000 bytes, but there are only 168 | /buffers/0
    /buffers/0/uri = | has no 'uri' | /buffers/0
    /bufferViews/1/byteLength = 73 | ends at byte 169 | /bufferViews/1
    /bufferViews/1/byteOffset = 1000000000000 | ends at byte | /bufferViews/1
    /bufferViews/0/byteStride = 1 | have 12 bytes
    /bufferViews/0/byteStride = 16 | ends at byte 124 | /accessors/0
    /bufferViews/0/byteStride = 4096 | more than 252
    /accessors/0/bufferView = 2 | there is no buffer view 2
    /accessors/0/bufferView = | has no 'bufferView' | /accessors/0
    /accessors/0/count = 9 | ends at byte 108 | /accessors/0
    /accessors/0/count = 4294967295 | ends at byte | /accessors/0
    /accessors/0/count = 4294967296 | more than
    /accessors/0/sparse/count = 4000000000 | is sparse | /accessors/0
    /accessors/0/count = 0 | is 0
    /accessors/0/byteOffset = 2 | multiple of 4 | /accessors/0
    /accessors/0/type = "SCALAR" | must be VEC3
    /accessors/0/componentType = 5120 | 5120 (byte)
    /accessors/0/componentType = 77 | 77 (unknown)
    /accessors/1/componentType = 5126 | 5126 (float)
    /accessors/0/count = 7 | is out of range: the primitive has 7 vertices | /meshes/0/primitives/0/indices
    /accessors/1/count = 35 | 35 corners make no whole | /meshes/0/primitives/0
    /meshes/0/primitives/0/mode = 77 | is 77, which is more than 6
    /meshes/0/primitives/0/attributes/POSITION = | has no 'POSITION' | /meshes/0/primitives/0/attributes
    /meshes/0/primitives/0/attributes/POSITION = 5 | there is no accessor 5
    /meshes/0/primitives/0/material = 5 | there is no material 5
    /meshes/0/primitives/0/extensions/KHR_draco_mesh_compression = {} |
        is compressed, which is not read; export it without compression | /meshes/0/primitives/0
    /meshes/0/primitives = | has no 'primitives' | /meshes/0
)");
}

TEST(Refusal, RefusesPhysics) {
  expect_refusals(R"(
    /#/1/type = "torus" | unknown 'torus'; known are sphere, box, capsule
    /#/1/sphere = {} | is a box, but also has 'sphere' | /#/1
    /#/1/box/size = [1, 0, 1] | greater than 0
    /#/1 = {"type": "sphere", "sphere": {"radius": -1}} |
        must be greater than 0, but is -1 | /#/1/sphere/radius
    /#/1 = {"type": "cylinder", "cylinder": {"radiusTop": 0, "radiusBottom": 0}} |
        radius 0 at both ends | /#/1/cylinder
    /#/1/box/size = [1e200, 1e200, 1e200] | too large or too small | /nodes/1/$/motion
    /#/1/box/size = [1e-200, 1e-200, 1e-200] | too large or too small | /nodes/1/$/motion
    /nodes/1/$/collider/geometry/shape = 2 | there is no implicit shape 2
    /nodes/1/$/collider/geometry = | has no 'geometry' | /nodes/1/$/collider
    /nodes/1/$/collider/geometry/node = 1 | one of 'shape', 'node' and 'mesh' | /nodes/1/$/collider/geometry
    /nodes/4/$/collider/geometry/node = 50 | there is no node 50
    /nodes/4/$/collider/geometry/node = 0 | has no mesh of triangles | /nodes/4/$/collider
    /nodes/4/scale = [1, 0, 1] | thin | /nodes/4/$/collider
    /nodes/1/$/collider/physicsMaterial = 1 | there is no physics material 1
    /nodes/1/$/collider/collisionFilter = 1 | there is no collision filter 1
    /$/collisionFilters/0/collideWithSystems = [] | keep one | /$/collisionFilters/0
    /$/physicsMaterials/0/staticFriction = -0.5 | must not be negative, but is -0.5
    /$/physicsMaterials/0/restitution = 1.5 | must be at most 1
    /$/physicsMaterials/0/frictionCombine = "mean" | unknown 'mean'
    /nodes/1/$/motion/mass = -2 | must not be negative, but is -2
    /nodes/1/$/motion/mass = "heavy" | must be a number, but is a string
    /nodes/1/$/motion/mass = null | must be a number, but is null
    /nodes/1/$/motion/mass = 1e-320 | too large or too small | /nodes/1/$/motion
    /nodes/1/$/motion/mass = 1e308; /#/1/box/size = [1, 2, 9] | too large or too small | /nodes/1/$/motion
    /nodes/1/$/motion/inertiaDiagonal = [1, 1, -1] | negative component
    /nodes/1/$/motion/inertiaOrientation = [1, 1, 1, 1] | its length is 2
    /nodes/1/$/motion/isKinematic = "yes" | must be true or false
    /nodes/1/$/trigger = {"nodes": [99]} | there is no node 99 | /nodes/1/$/trigger/nodes/0
    /nodes/1/$/trigger = {} | has no 'geometry'
    /nodes/1/$/trigger = {"geometry": {"shape": 5}} |
        there is no implicit shape 5 | /nodes/1/$/trigger/geometry/shape
    /#/0/plane = {"sizeX": 0} | must be greater than 0 | /#/0/plane/sizeX
    /nodes/2/$/joint/connectedNode = 12 | there is no node 12
    /nodes/2/$/joint/connectedNode = | has no 'connectedNode' | /nodes/2/$/joint
    /nodes/2/$/joint/joint = 1 | there is no physics joint 1
    /$/physicsJoints/0/limits/0/angularAxes = [0] |
        one of 'linearAxes' and 'angularAxes' | /$/physicsJoints/0/limits/0
    /$/physicsJoints/0/limits/0/linearAxes = [0, 3] |
        is 3, which is more than 2 | /$/physicsJoints/0/limits/0/linearAxes/1
    /$/physicsJoints/0/limits/0/linearAxes = [0, 0] |
        names axis 0 again | /$/physicsJoints/0/limits/0/linearAxes/1
    /$/physicsJoints/0/limits/0/linearAxes = [] | names no axis
    /$/physicsJoints/0/limits/0/max = -1 | has min 0 above max -1 | /$/physicsJoints/0/limits/0
    /$/physicsJoints/0/limits/0 = {"linearAxes": [0, 2], "max": -1} | no distance of 0 or more lies from -inf to -1
    /$/physicsJoints/0/limits/0 = {"angularAxes": [0, 1], "min": 4} | no angle between 0 and pi lies from 4 to inf
    /$/physicsJoints/0/limits/0 = {"angularAxes": [1], "min": 3.5, "max": 3.5} |
        no angle between -pi and pi lies from 3.5 to 3.5
    /$/physicsJoints/0/limits/0/stiffness = -1 | must not be negative
    /$/physicsJoints/0/drives/0/type = "spherical" | unknown 'spherical'; known are linear, angular
    /$/physicsJoints/0/drives/0/axis = 3 | is 3, which is more than 2
    /$/physicsJoints/0/drives/0/positionTarget = 4; /$/physicsJoints/0/drives/0/stiffness = 1 |
        must lie between -pi and pi, but is 4 | /$/physicsJoints/0/drives/0/positionTarget
    /nodes/3/$/joint = {"connectedNode": 0, "joint": 0} | neither belongs to a body | /nodes/3/$/joint
    /nodes/2/$/joint/connectedNode = 1 | joins the body 'crate' to itself | /nodes/2/$/joint
    /nodes/2/$/joint/connectedNode = 5 | which is not in the scene
    /nodes/1/$/collider/geometry/shape = 0 |
        a plane cannot belong to a body with motion: use a box | /nodes/1/$/collider
    /nodes/1/rotation = [0, 0, 0.6, 0.8]; /nodes/- = {"scale": [2, 1, 1], "children": [1]}; /scenes/0/nodes/1 = 8 |
        is sheared or flat | /nodes/1
    /$/physicsJoints/0/drives/0/maxForce = -3 | must not be negative
)");
}

TEST(Refusal, RefusesMoreThan64Systems) {
  Json systems;
  for (int i = 0; i < 65; ++i) systems.push_back("system " + std::to_string(i));
  const std::string edit = "/$/collisionFilters/0/collisionSystems = " + systems.dump();
  EXPECT_THAT(complaint(edited(edit)), HasSubstr("more than 64 collision systems"));
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
    Json document = example();
    document["buffers"][0]["uri"] = "data:application/gltf-buffer;base64," + base64(buffer);
    EXPECT_THAT(complaint(document), HasSubstr("/meshes/0/primitives/0: vertex 3 is not finite"));
  }
}

TEST(Refusal, RefusesBadUris) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "inner");
  folder.write("outside.bin", cube_buffer());
  std::filesystem::create_symlink(folder.path() / "outside.bin", folder.path() / "inner/link.bin");
  std::filesystem::create_directories(folder.path() / "inner/folder");
  for (const auto& row : rows(R"(
    ../outside.bin | leaves the scene's folder
    %2e%2e/outside.bin | leaves the scene's folder
    folder/../../outside.bin | leaves the scene's folder
    ../../../../../../../../etc/passwd | leaves the scene's folder
    /etc/passwd | leaves the scene's folder
    link.bin | leaves the scene's folder
    missing.bin | there is no file 'missing.bin' beside the scene
    folder | is not a regular file
    | is empty
    % | two hexadecimal digits
    a%2 | two hexadecimal digits
    a%zz | two hexadecimal digits
    a%00b | control character
    https://example.org/cube.bin | network address
    data:application/octet-stream;base64 | without a comma
    data:text/plain,hello | not base64
    data:application/octet-stream;base64,AA AA | not base64 (code 32)
    data:application/octet-stream;base64,AAAA | there are only 3)")) {
    Json document = example();
    document["buffers"][0]["uri"] = row[0];
    EXPECT_THAT(complaint(folder.write("inner/scene.gltf", document.dump())), HasSubstr(row[1])) << row[0];
  }
}

TEST(Refusal, RefusesOtherFiles) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "folder.gltf");
  const std::string deep = "{\"extras\": " + std::string(100'000, '[') + std::string(100'000, ']') + "}";
  for (const auto& [name, content] :
       {std::pair<const char*, std::string>{"empty.gltf", ""},
        {"empty.glb", ""},
        {"blank.gltf", " \n "},
        {"scene.txt", "hello"},
        {"text.gltf", "hello"},
        {"number.gltf", "1"},
        {"bytes.gltf", "{\"asset\": \"\xff\"}"},
        {"nan.gltf", "{\"asset\": NaN}"},
        {"twice.gltf", R"({"asset": {"version": "2.0"}, "scene": 0, "scene": 0})"},
        {"deep.gltf", deep}}) {
    folder.write(name, content);
  }
  for (const auto& row : rows(R"(
    missing.gltf | there is no such file
    missing.txt | there is no such file
    missing.obj | there is no such file
    folder.gltf | is not a regular file
    /dev/zero | is not a regular file
    empty.gltf | is empty
    empty.glb | is empty
    blank.gltf | is empty
    scene.txt | is neither a scene (.gltf, .glb) nor a mesh
    text.gltf | is not valid JSON: parse error at line 1
    number.gltf | is JSON, but not an object
    bytes.gltf | is not valid JSON
    nan.gltf | is not valid JSON
    twice.gltf | the key 'scene' stands twice in one object
    deep.gltf | its JSON is nested deeper than 64 levels after the key 'extras')")) {
    EXPECT_THAT(complaint(folder.path() / row[0]), HasSubstr(row[0] + ": " + row[1]));
  }
  EXPECT_THAT(complaint(folder.path() / (std::string(300, 'x') + ".gltf")), HasSubstr("cannot be read: "));
}

class Glb : public testing::Test {
 protected:
  Glb() {
    Json document = example();
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

TEST_F(Glb, RefusesTruncatedAndPaddedFiles) {
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

/// Returns the example with a texture.
Json textured() {
  // The first bytes of every PNG file, in base64: loading decodes no more.
  return edited(R"(/images = [{"uri": "data:image/png;base64,iVBORw0KGgo="}];
    /samplers = [{"magFilter": 9728, "minFilter": 9987, "wrapS": 33071}];
    /textures = [{"source": 0, "sampler": 0}];
    /materials/0/pbrMetallicRoughness/baseColorTexture = {"index": 0})");
}

/// Expects a warning for each row: an edit | words of the warning, none where there is no warning.
void expect_warnings(const Json& document, const std::string& table) {
  for (const auto& row : rows(table)) {
    SCOPED_TRACE(row[0]);
    const std::string text = warnings(edited(document, row[0]));
    if (row.size() > 1) {
      EXPECT_THAT(text, HasSubstr(row[1]));
    } else {
      EXPECT_EQ(text, "");
    }
  }
}

TEST(Features, ReplacesUnsupportedWithWarning) {
  expect_warnings(example(), R"(
    /#/1 = {"type": "capsule"}; /nodes/1/scale = [1, 2, 1] |
        a capsule under an unequal scale collides as the hull of
    /#/1 = {"type": "cylinder"}; /nodes/1/scale = [1, 1, 2] |
        a cylinder made elliptic by its node's scale collides as a prism of 32 sides
    /nodes/4/scale = [0, 0, 0] | is left out: its node is scaled to nothing
    /nodes/3/rotation = [0, 0, 0.6, 0.8]; /nodes/- = {"scale": [2, 1, 1], "children": [3]}; /scenes/0/nodes/2 = 8 |
        is turned inside an unequal scale; the joint's frame is turned without the scale
    /nodes/4/$ = {"motion": {"inertiaDiagonal": [1, 1, 1]}} |
        has neither 'mass' nor a collider to take it from: it gets 1 kg
    /nodes/4/$ = {"motion": {"mass": 2}} |
        has neither 'inertiaDiagonal' nor a collider to take it from: it gets that of a ball of water
    /nodes/1/$/motion/inertiaOrientation = [0, 1, 0, 0] | inertiaOrientation has no effect without
    /$/physicsJoints/0/drives/0/positionTarget = 1 | positionTarget has no effect without stiffness
    /$/physicsJoints/0/drives/0/damping = | velocityTarget has no effect without damping
    /$/physicsJoints/0/drives/0/damping = | a drive without stiffness and damping has no effect
    /$/physicsJoints/0/limits/0 = {"angularAxes": [2], "min": -4, "max": 4} | an end beyond pi has no effect
    /$/physicsJoints/0/limits/0 = {"angularAxes": [2]} | a limit without min and max has no effect
    /$/physicsJoints/0/limits/0/damping = 1 | damping has no effect without stiffness
    /$/physicsJoints/0/limits/0/stiffness = 0 | stiffness 0 has no effect without damping
    /nodes/1/$/collider/geometry/convexHull = true | convexHull has no effect beside 'shape'
    /nodes/3/$/trigger = {"geometry": {"shape": 1}} | a trigger is ignored: it moves nothing
    /nodes/4/$ = {"motion": {"mass": 2, "inertiaDiagonal": [1, 5, 1]}} |
        one moment is above the sum of the two others, as no body has it: check the digits
    /extensionsUsed/- = "KHR_materials_ior" | /extensionsUsed/3: the extension 'KHR_materials_ior' is ignored
    /animations = [] | /animations: are ignored: nodes move as bodies or not at all
    /meshes/0/primitives/0/targets = [{"POSITION": 0}] | morph targets are ignored
    /meshes/0/primitives/- = {"mode": 1, "attributes": {"POSITION": 0}} | points and lines are left out
    /cameras/0 = {"type": "orthographic"} | only perspective cameras are drawn with; it is ignored)");
  expect_warnings(textured(), R"(
    /images/0/uri = "data:image/webp;base64,UklGRg==" |
        is neither PNG nor JPEG: surfaces are drawn without it
    /images/0/uri = "wood.png" | there is no such file: surfaces are drawn without it)");
  EXPECT_THAT(
      warnings(skinned(example(), 5, "[1, 3]")),
      HasSubstr("the skinned mesh of node 'rock shape' collides in the form that it has at the start"));
  EXPECT_THAT(warnings(skinned(example(), 1, "[1, 3]")),
              HasSubstr("skinned meshes are drawn in rigid pieces, each with the body"));
  EXPECT_THAT(complaint(edited(skinned(example(), 5, "[1, 3]"), "/nodes/5/scale = [1, 0, 1]")),
              HasSubstr("its geometry's node is scaled to nothing along an axis"));
}

TEST(Features, LoadWithoutWarning) {
  expect_warnings(example(), R"(
    /#/0/plane = {"sizeX": 4, "sizeZ": 4, "doubleSided": true}
    /$/physicsJoints/0/limits/0 = {"angularAxes": [2], "min": -3.1415927, "max": 3.1415927}
    /nodes/1/$/motion/inertiaDiagonal = [1, 2, 3]
    /nodes/1/$/motion/inertiaDiagonal = [1, 0, 5]
    /materials/0/alphaMode = "MASK"; /materials/0/alphaCutoff = 0.3; /materials/0/doubleSided = true
    /meshes/0/primitives/0/attributes/COLOR_0 = 0)");
  expect_warnings(textured(), R"(
    /extensionsRequired = ["KHR_texture_transform", "KHR_materials_unlit", "KHR_materials_emissive_strength"];
    /materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/rotation = 1;
    /materials/0/emissiveFactor = [1, 1, 1]; /materials/0/extensions/KHR_materials_unlit = {};
    /materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength = 5)");
}

TEST(Features, RefusesThirdSetOfTextureCoordinates) {
  const Json document = edited(textured(), "/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord = 2");
  EXPECT_THAT(complaint(document), HasSubstr("only the sets 0 and 1"));
}

TEST(Features, WarnsOfMoreThan16Lights) {
  Json document = edited(R"(/extensions/KHR_lights_punctual/lights/- = {"type": "point"})");
  for (int i = 0; i < 17; ++i) {
    document["scenes"][0]["nodes"].push_back(document["nodes"].size());
    document["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}});
  }
  EXPECT_THAT(warnings(document), HasSubstr("more than 16 lights besides the sun"));
}

TEST(Features, SimplifiesHullOfMoreThan256Vertices) {
  // Points on a paraboloid, all of them corners of the hull.
  std::vector<float> points;
  std::vector<std::uint16_t> indices;
  for (int i = 0; i < 400; ++i) {
    const float x = static_cast<float>(i % 20) / 10 - 1;
    const float z = static_cast<float>(i / 20) / 10 - 1;
    points.insert(points.end(), {x, x * x + z * z, z});
    for (int k = 0; k < 3 && i + 2 < 400; ++k) indices.push_back(static_cast<std::uint16_t>(i + k));
  }
  std::string bytes(reinterpret_cast<const char*>(points.data()), 4 * points.size());
  bytes.append(reinterpret_cast<const char*>(indices.data()), 2 * indices.size());
  Json document = edited(R"(/bufferViews/0/byteLength = 4800; /accessors/0/count = 400;
    /bufferViews/1 = {"buffer": 0, "byteOffset": 4800, "byteLength": 2388}; /accessors/1/count = 1194)");
  document["buffers"][0] = {{"byteLength", bytes.size()}, {"uri", "data:;base64," + base64(bytes)}};
  EXPECT_THAT(warnings(document), HasSubstr("is simplified to"));
}

}  // namespace
}  // namespace substep
