/// Loads a document for each feature of glTF and its extensions that is supported, replaced or refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "sim/math/base64.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace test;

json& shape(json& document, int index) {
  return document["extensions"]["KHR_implicit_shapes"]["shapes"][index];
}

json& drive(json& document) {
  return document["extensions"]["KHR_physics_rigid_bodies"]["physicsJoints"][0]["drives"][0];
}

// The first bytes of every PNG file, in base64: loading decodes no more.
constexpr const char* png_start = "iVBORw0KGgo=";

// The first material's colour from an image of these bytes.
void add_texture(json& document, const std::string& in_base64) {
  document["images"] = {{{"uri", "data:image/png;base64," + in_base64}}};
  document["samplers"] = {{{"magFilter", 9728}, {"minFilter", 9987}, {"wrapS", 33071}}};
  document["textures"] = {{{"source", 0}, {"sampler", 0}}};
  document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
}

// Joints and weights for the cube's eight corners, half of them on each of nodes 1 and 3.
void add_skin(json& document, int node) {
  std::string bytes = cube_buffer();
  std::string joints;
  std::string weights;
  for (int corner = 0; corner < 8; ++corner) {
    joints += std::string(1, static_cast<char>(corner / 4)) + std::string(3, '\0');
    weights += std::string("\xff\0\0\0", 4);
  }
  json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = add_accessor(document, bytes, joints, 5121, "VEC4");
  attributes["WEIGHTS_0"] = add_accessor(document, bytes, weights, 5121, "VEC4");
  document["accessors"].back()["normalized"] = true;
  document["skins"] = {{{"joints", {1, 3}}}};
  document["nodes"][node]["skin"] = 0;
}

void shear(json& document, int node) {
  document["nodes"][node]["rotation"] = {0, 0, 0.3826834323650898, 0.9238795325112867};
  document["nodes"].push_back({{"scale", {2, 1, 1}}, {"children", {node}}});
  for (json& root : document["scenes"][0]["nodes"]) {
    if (root == node) root = document["nodes"].size() - 1;
  }
}

enum class Outcome { supported, warned, refused };

struct Feature {
  const char* name;
  Outcome outcome;
  const char* words;  // of the warning or the refusal
  std::function<void(json&)> change;
};

const std::vector<Feature>& features() {
  static const std::vector<Feature> all{
      {"plane on a body with motion", Outcome::refused,
       "a plane cannot belong to a body with motion: use a box",
       [](json& d) { physics(d, 1)["collider"]["geometry"]["shape"] = 0; }},
      {"convex hull of more than 256 vertices", Outcome::warned, "is simplified to",
       [](json& d) {
         // Points on a paraboloid, all of them corners of the hull.
         std::string bytes;
         for (int i = 0; i < 400; ++i) {
           const float x = static_cast<float>(i % 20) / 10 - 1, z = static_cast<float>(i / 20) / 10 - 1;
           for (const float value : {x, x * x + z * z, z}) {
             bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
           }
         }
         for (int i = 0; i + 2 < 400; ++i) {
           for (int k = 0; k < 3; ++k) {
             const auto index = static_cast<std::uint16_t>(i + k);
             bytes.append(reinterpret_cast<const char*>(&index), sizeof index);
           }
         }
         d["buffers"][0] = {{"byteLength", bytes.size()},
                            {"uri", "data:application/octet-stream;base64," + base64(bytes)}};
         d["bufferViews"] = {{{"buffer", 0}, {"byteLength", 4800}},
                             {{"buffer", 0}, {"byteOffset", 4800}, {"byteLength", 398 * 6}}};
         d["accessors"][0]["count"] = 400;
         d["accessors"][1]["count"] = 398 * 3;
       }},
      {"skinned collider", Outcome::warned,
       "the skinned mesh of node 'rock shape' collides in the form that it has at the start",
       [](json& d) { add_skin(d, 5); }},
      {"skinned mesh, drawn", Outcome::warned,
       "skinned meshes are drawn in rigid pieces, each with the body that holds most of it",
       [](json& d) { add_skin(d, 1); }},
      {"unequal scale of a capsule", Outcome::warned,
       "a capsule under an unequal scale collides as the hull of",
       [](json& d) {
         shape(d, 1) = {{"type", "capsule"}};
         d["nodes"][1]["scale"] = {1, 2, 1};
       }},
      {"cylinder scaled unequally across its axis", Outcome::warned,
       "a cylinder made elliptic by its node's scale collides as a prism of 32 sides",
       [](json& d) {
         shape(d, 1) = {{"type", "cylinder"}};
         d["nodes"][1]["scale"] = {1, 1, 2};
       }},
      {"scale of 0", Outcome::warned, "is left out: its node is scaled to nothing",
       [](json& d) {
         d["nodes"][4]["scale"] = {0, 0, 0};
       }},
      {"body or collider turned inside an unequal scale", Outcome::refused, "is sheared or flat",
       [](json& d) { shear(d, 1); }},
      {"joint turned inside an unequal scale", Outcome::warned,
       "is turned inside an unequal scale; the joint's frame is turned without the scale",
       [](json& d) { shear(d, 3); }},
      {"no mass and no collider", Outcome::warned,
       "has neither 'mass' nor a collider to take it from: it gets 1 kg",
       [](json& d) {
         physics(d, 4) = {{"motion", {{"inertiaDiagonal", {1, 1, 1}}}}};
       }},
      {"no inertia and no collider", Outcome::warned,
       "has neither 'inertiaDiagonal' nor a collider to take it from: it gets that of a ball of water",
       [](json& d) {
         physics(d, 4) = {{"motion", {{"mass", 2}}}};
       }},
      {"`positionTarget` without stiffness", Outcome::warned,
       "positionTarget has no effect without stiffness", [](json& d) { drive(d)["positionTarget"] = 1; }},
      {"`velocityTarget` without damping", Outcome::warned, "velocityTarget has no effect without damping",
       [](json& d) { drive(d).erase("damping"); }},
      {"joint to a node outside the scene", Outcome::refused, "which is not in the scene",
       [](json& d) { physics(d, 2)["joint"]["connectedNode"] = 5; }},
      {"trigger", Outcome::warned, "a trigger is ignored: it moves nothing",
       [](json& d) {
         physics(d, 3)["trigger"] = {{"geometry", {{"shape", 1}}}};
       }},
      {"images in other formats", Outcome::warned, "is neither PNG nor JPEG: surfaces are drawn without it",
       [](json& d) { add_texture(d, "UklGRg=="); }},
      {"an image's file that is missing", Outcome::warned,
       "there is no such file: surfaces are drawn without it",
       [](json& d) {
         add_texture(d, png_start);
         d["images"][0]["uri"] = "wood.png";
       }},
      {"texture coordinates of a third set", Outcome::refused, "two sets are read, 0 and 1",
       [](json& d) {
         add_texture(d, png_start);
         d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 2;
       }},
      {"animations", Outcome::warned, "animations are ignored: nodes move as bodies or not at all",
       [](json& d) { d["animations"] = json::array(); }},
      {"morph targets", Outcome::warned, "morph targets are ignored",
       [](json& d) {
         d["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 0}}};
       }},
      {"points and lines", Outcome::warned, "points and lines are left out",
       [](json& d) {
         d["meshes"][0]["primitives"].push_back({{"mode", 1}, {"attributes", {{"POSITION", 0}}}});
       }},
      {"orthographic camera", Outcome::warned, "only perspective cameras are drawn with; it is ignored",
       [](json& d) {
         d["cameras"][0] = {{"type", "orthographic"}};
       }},
      {"more than 16 lights beside that one", Outcome::warned, "more than 16 lights beside the sun",
       [](json& d) {
         d["extensions"]["KHR_lights_punctual"]["lights"].push_back({{"type", "point"}});
         for (int i = 0; i < 17; ++i) {
           d["scenes"][0]["nodes"].push_back(d["nodes"].size());
           d["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}});
         }
       }},
      {"compressed meshes", Outcome::refused,
       "is compressed, which is not read; export it without compression",
       [](json& d) {
         d["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = json::object();
       }},
      {"any other required extension", Outcome::refused, "which is not read",
       [](json& d) { d["extensionsRequired"].push_back("KHR_something_else"); }},
      {"finite or double-sided plane in the world", Outcome::supported, "",
       [](json& d) {
         shape(d, 0)["plane"] = {{"sizeX", 4}, {"sizeZ", 4}, {"doubleSided", true}};
       }},
      {"texture transforms, unlit materials, strong emission", Outcome::supported, "",
       [](json& d) {
         d["extensionsRequired"] = {"KHR_texture_transform", "KHR_materials_unlit",
                                    "KHR_materials_emissive_strength"};
         add_texture(d, png_start);
         json& texture = d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
         texture["extensions"]["KHR_texture_transform"] = {{"scale", {2, 3}}, {"rotation", 1}};
         d["materials"][0]["emissiveFactor"] = {1, 1, 1};
         d["materials"][0]["extensions"] = {{"KHR_materials_unlit", json::object()},
                                            {"KHR_materials_emissive_strength", {{"emissiveStrength", 5}}}};
       }},
      {"masks, blending, two sides", Outcome::supported, "",
       [](json& d) {
         d["materials"][0]["alphaMode"] = "MASK";
         d["materials"][0]["alphaCutoff"] = 0.3;
         d["materials"][0]["doubleSided"] = true;
       }},
      {"vertex colours", Outcome::supported, "",
       [](json& d) {
         d["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
             d["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
       }},
  };
  return all;
}

TEST(Features, DoWhatTheirRowsSay) {
  for (const Feature& feature : features()) {
    SCOPED_TRACE(feature.name);
    json document = example();
    feature.change(document);
    if (feature.outcome == Outcome::refused) {
      EXPECT_THAT(complaint(document), HasSubstr(feature.words));
      continue;
    }
    ASSERT_EQ(complaint(document), "");
    const Scene scene = load(document);
    if (feature.outcome == Outcome::supported) {
      EXPECT_THAT(scene.warnings, IsEmpty());
    } else {
      EXPECT_THAT(scene.warnings, Contains(HasSubstr(feature.words)));
    }
  }
}

}  // namespace
}  // namespace substep
