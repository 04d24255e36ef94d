// Tests small files that could need much memory: each loads or is refused within a gibibyte and two seconds.
// This is one file, since its cases are one table of small files.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sim/loading/json_value.h"
#include "sim/loading/load_scene.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using testing::HasSubstr;
using namespace test;

constexpr std::size_t largest_crafted = std::size_t{1} << 20;
constexpr double most_mebibytes = 1024;  // measured 270
// Sanitizers take several times as long; gcc and clang have different macros for them.
#ifndef __has_feature
#define __has_feature(feature) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || __has_feature(address_sanitizer) || !defined(NDEBUG)
constexpr double most_seconds = 20;
#else
constexpr double most_seconds = 2;  // measured 1.3
#endif

struct Crafted {
  std::string file;
  std::string bytes;
  std::optional<MeshOptions> options;
};

struct Case {
  const char* name;
  const char* place;  ///< position and words that a refusal must contain; empty where the file loads
  const char* words;
  std::function<Crafted()> make;
};

void PrintTo(const Case& tried, std::ostream* out) {
  *out << tried.name;
}

/// Positions and indices, stored in this order.
struct Geometry {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;

  void add(double x, double y, double z) {
    for (const double coordinate : {x, y, z}) positions.push_back(static_cast<float>(coordinate));
  }
  std::size_t vertices() const { return positions.size() / 3; }
};

/// Returns points spread over a ball, each of which a triangle uses: others are not in hulls.
Geometry ball(std::size_t points) {
  Geometry geometry;
  for (std::size_t i = 0; i < points; ++i) {
    const double y = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(points);
    const double angle = 2.4 * static_cast<double>(i);
    geometry.add(std::sqrt(1 - y * y) * std::cos(angle), y, std::sqrt(1 - y * y) * std::sin(angle));
    geometry.indices.push_back(static_cast<std::uint32_t>(i));
  }
  geometry.indices.resize((points + 2) / 3 * 3, 0);
  return geometry;
}

Geometry grid(std::size_t side) {
  Geometry geometry;
  for (std::size_t i = 0; i < side * side; ++i) {
    geometry.add(static_cast<double>(i % side), 0, static_cast<double>(i / side));
  }
  for (std::uint32_t i = 0; i + side + 1 < side * side; ++i) {
    if (i % side + 1 == side) continue;
    const auto below = static_cast<std::uint32_t>(i + side);
    for (const std::uint32_t corner : {i, below, i + 1, i + 1, below, below + 1}) {
      geometry.indices.push_back(corner);
    }
  }
  return geometry;
}

/// Returns a document of one mesh of one primitive, without nodes.
Json document_of(const Geometry& geometry) {
  const std::size_t positions = 4 * geometry.positions.size();
  const std::size_t indices = 4 * geometry.indices.size();
  Json document = Json::parse(R"({"asset": {"version": "2.0"},
    "extensionsUsed": ["KHR_physics_rigid_bodies", "KHR_implicit_shapes"], "nodes": []})");
  document["buffers"] = {{{"byteLength", positions + indices}}};
  document["bufferViews"] = {{{"buffer", 0}, {"byteLength", positions}},
                             {{"buffer", 0}, {"byteOffset", positions}, {"byteLength", indices}}};
  document["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5126}, {"type", "VEC3"}, {"count", geometry.vertices()}},
      {{"bufferView", 1}, {"componentType", 5125}, {"type", "SCALAR"}, {"count", geometry.indices.size()}}};
  document["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}};
  return document;
}

Crafted as_glb(const Json& document, const Geometry& geometry) {
  std::string binary(4 * (geometry.positions.size() + geometry.indices.size()), '\0');
  std::memcpy(binary.data(), geometry.positions.data(), 4 * geometry.positions.size());
  std::memcpy(binary.data() + 4 * geometry.positions.size(), geometry.indices.data(),
              4 * geometry.indices.size());
  return {"crafted.glb", glb(document.dump(), binary), {}};
}

Crafted as_gltf(const Json& document) {
  return {"crafted.gltf", document.dump(), {}};
}

Json collider_of_node(int node, bool hull, bool moves) {
  Json physics = {{"collider", {{"geometry", {{"node", node}, {"convexHull", hull}}}}}};
  if (moves) physics["motion"] = {{"mass", 1}};
  return {{"extensions", {{"KHR_physics_rigid_bodies", physics}}}};
}

/// Adds node 0 with the mesh, and `count` colliders of its geometry, each in its own scale if `scaled`.
Json with_colliders(Json document, int count, bool hull, bool moves, bool scaled) {
  document["nodes"].push_back({{"mesh", 0}});
  for (int i = 0; i < count; ++i) {
    Json node = collider_of_node(0, hull, moves);
    if (scaled) node["scale"] = {1 + 0.001 * i, 1, 1};
    document["nodes"].push_back(node);
  }
  return document;
}

Crafted collided(const Geometry& geometry, int count, bool hull, bool moves, bool scaled) {
  return as_glb(with_colliders(document_of(geometry), count, hull, moves, scaled), geometry);
}

Json with_shapes(const char* shape, int count, bool scaled) {
  Json document = one_body("{}", shape);
  const Json node = document["nodes"][0];
  document.erase("scenes");
  for (int i = 1; i < count; ++i) {
    Json copy = node;
    copy["name"] = std::to_string(i);
    if (scaled) copy["scale"] = {1 + 0.001 * i, 1, 2};
    document["nodes"].push_back(copy);
  }
  return document;
}

void repeat(Json& list, int count) {
  for (int i = 0; i < count; ++i) list.push_back(list[0]);
}

/// Returns nodes that are each the child of the one before.
Json chain(int length) {
  Json document = edited("/scenes =; /scene =; /nodes = []");
  for (int i = 0; i < length; ++i) document["nodes"].push_back({{"children", {i + 1}}});
  document["nodes"].push_back(Json::object());
  return document;
}

/// Returns a document with `count` nodes that have a skin whose joints are all node 0.
Json with_skins(const Geometry& geometry, int count, std::size_t joints) {
  Json document = document_of(geometry);
  const std::size_t vertices = geometry.vertices();
  const std::size_t begin = document["buffers"][0]["byteLength"];
  document["buffers"][0]["byteLength"] = begin + 8 * vertices;
  document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", 8 * vertices}});
  document["accessors"].push_back(
      {{"bufferView", 2}, {"componentType", 5121}, {"type", "VEC4"}, {"count", vertices}});
  document["accessors"].push_back({{"bufferView", 2},
                                   {"byteOffset", 4 * vertices},
                                   {"componentType", 5121},
                                   {"normalized", true},
                                   {"type", "VEC4"},
                                   {"count", vertices}});
  Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = 2;
  attributes["WEIGHTS_0"] = 3;
  document["skins"] = {{{"joints", std::vector<int>(joints, 0)}}};
  document["nodes"].push_back({{"extensions", {{"KHR_physics_rigid_bodies", {{"motion", {{"mass", 1}}}}}}}});
  for (int i = 0; i < count; ++i) document["nodes"].push_back({{"mesh", 0}, {"skin", 0}});
  return document;
}

Crafted skinned_glb(const Geometry& geometry, int count, std::size_t joints) {
  Geometry more = geometry;
  more.indices.resize(more.indices.size() + geometry.vertices(), 0);            // joints
  more.indices.resize(more.indices.size() + geometry.vertices(), 0x000000ffU);  // weights
  return as_glb(with_skins(geometry, count, joints), more);
}

Crafted text_mesh(const Geometry& geometry, int copies) {
  std::string text;
  for (std::size_t i = 0; i < geometry.vertices(); ++i) {
    const float* point = &geometry.positions[3 * i];
    text += fmt::format("v {} {} {}\n", point[0], point[1], point[2]);
    if (i >= 2) text += fmt::format("f {} {} {}\n", i - 1, i, i + 1);
  }
  MeshOptions options;
  options.copies = copies;
  return {"crafted.obj", text, options};
}

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"PrimitivesShareAnAccessor", "/meshes/0/primitives", "more than",
       [] {
         const Geometry geometry = ball(30'000);
         Json document = document_of(geometry);
         document["nodes"].push_back({{"mesh", 0}});
         for (int i = 0; i < 9000; ++i)
           document["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 6}});
         return as_glb(document, geometry);
       }},
      {"DeepNodes", "/nodes/256", "deeper than 256", [] { return as_gltf(chain(50'000)); }},
      {"ManyBodies", "", "", [] { return as_gltf(with_shapes(R"({"type": "sphere"})", 5500, false)); }},
      {"ManyEllipsoids", "", "", [] { return as_gltf(with_shapes(R"({"type": "sphere"})", 5500, true)); }},
      {"ManyEllipticCylinders", "", "",
       [] { return as_gltf(with_shapes(R"({"type": "cylinder"})", 5500, true)); }},
      {"ManyTaperedCapsules", "", "",
       [] {
         return as_gltf(with_shapes(
             R"({"type": "capsule", "capsule": {"height": 1, "radiusBottom": 0.5, "radiusTop": 0.2}})", 5500,
             true));
       }},
      {"OneHullManyTimes", "", "", [] { return collided(ball(256), 6000, true, true, false); }},
      {"HullsOfOneMeshInManyScales", "/collider", "has more than",
       [] { return collided(ball(512), 6000, true, true, true); }},
      {"HullsOfAllPoints", "", "",  // as many points as fit
       [] { return collided(ball(60'000), 1, true, true, false); }},
      {"FlatHull", "/collider", "thinner than", [] { return collided(grid(150), 1, true, true, false); }},
      {"GroundsOfOneMesh", "/collider", "has more than",
       [] { return collided(grid(100), 4000, false, false, false); }},
      {"GroundOfFan", "", "",  // all triangles at one vertex
       [] {
         Geometry geometry = ball(35'000);
         geometry.indices.clear();
         for (std::uint32_t i = 1; i + 1 < geometry.vertices(); ++i) {
           for (const std::uint32_t corner : {0U, i, i + 1}) geometry.indices.push_back(corner);
         }
         return collided(geometry, 1, false, false, false);
       }},
      {"CollidersOfOneTree", "/collider", "has more than",
       [] {
         const Geometry geometry = ball(100);
         Json document = with_colliders(document_of(geometry), 3000, true, true, true);
         std::vector<int> children;
         for (int i = 0; i < 9000; ++i) {
           children.push_back(static_cast<int>(document["nodes"].size()));
           document["nodes"].push_back(Json::object());
         }
         document["nodes"][0]["children"] = children;
         return as_glb(document, geometry);
       }},
      {"JointOfManyLimits", "/physicsJoints/0/limits", "entries; the most that is read is 100",
       [] {
         Json document = example();
         repeat(document[Json::json_pointer(pointer("/$/physicsJoints/0/limits"))], 10'000);
         return as_gltf(document);
       }},
      {"ManyJoints", "", "",
       [] {
         Json document = example();
         repeat(document[Json::json_pointer(pointer("/$/physicsJoints/0/limits"))], 99);
         for (int i = 0; i < 5000; ++i) {
           document["nodes"][1]["children"].push_back(document["nodes"].size());
           document["nodes"].push_back(document["nodes"][2]);
         }
         return as_gltf(document);
       }},
      {"LongNameOfManyPrimitives", "/meshes/0/name", "the longest name",
       [] {
         Json document = edited("/meshes/0/name = \"" + std::string(300'000, 'n') + '"');
         repeat(document["meshes"][0]["primitives"], 9000);
         return as_gltf(document);
       }},
      {"PrimitivesOfManyNodes", "/nodes/", "primitives are to be drawn",
       [] {
         Json document = edited("/scenes =; /scene =");
         repeat(document["meshes"][0]["primitives"], 9000);
         for (int i = 0; i < 9000; ++i) document["nodes"].push_back({{"mesh", 0}});
         return as_gltf(document);
       }},
      {"SkinOfTooManyNodes", "/nodes/", "has more than",
       [] { return skinned_glb(ball(10'000), 10'000, 100); }},
      {"SkinOfManyNodes", "", "", [] { return skinned_glb(ball(1000), 50, 100); }},
      {"BuffersAreTheFileItself", "", "",
       [] {
         Json document = example();
         for (int i = 0; i < 20'000; ++i)
           document["buffers"].push_back({{"byteLength", 1}, {"uri", "crafted.gltf"}});
         return as_gltf(document);
       }},
      {"DenormalVertices", "/collider", "thinner than",
       [] {
         Geometry geometry = ball(20'000);
         for (float& coordinate : geometry.positions) coordinate *= 1e-42F;
         for (std::size_t i = 2; i < geometry.positions.size(); i += 3) geometry.positions[i] = 0;
         return collided(geometry, 1, true, true, false);
       }},
      {"FarVertices", "/collider", "within ±1e9 m",
       [] {
         Geometry geometry = ball(20'000);
         for (float& coordinate : geometry.positions) coordinate *= 1e38F;
         return collided(geometry, 1, true, true, false);
       }},
      {"StepsWithoutEnd", "", "",  // the loader only reads them; a run refuses them
       [] { return as_gltf(edited("/extras/substep = {\"duration\": 1e300, \"step\": 1e-300}")); }},
      {"MeshDroppedTooOften", "/nodes/", "the meshes to drop",
       [] {
         Geometry geometry = grid(100);
         Json document = document_of(geometry);
         document.erase("extensionsUsed");
         for (int i = 0; i < 5000; ++i) document["nodes"].push_back({{"mesh", 0}});
         return as_glb(document, geometry);
       }},
      {"CopiesOfMesh", "", "", [] { return text_mesh(ball(5000), 1000); }},
      {"TooManyCopies", "crafted.obj", "copies",
       [] { return text_mesh(ball(5000), std::numeric_limits<int>::max()); }},
  };
  return all;
}

class SmallFile : public testing::TestWithParam<Case> {};

TEST_P(SmallFile, TakesLittleMemoryAndTime) {
  const Case& tried = GetParam();
  const Crafted crafted = tried.make();
  ASSERT_LE(crafted.bytes.size(), largest_crafted);
  const TemporaryFolder folder;
  const Outcome outcome = outcome_of(folder.write(crafted.file, crafted.bytes), crafted.options);
  RecordProperty("mebibytes", std::to_string(outcome.mebibytes));
  RecordProperty("seconds", std::to_string(outcome.seconds));
  fmt::print("{}: {} bytes, {:.0f} MiB, {:.3f} s: {}\n", tried.name, crafted.bytes.size(), outcome.mebibytes,
             outcome.seconds, outcome.message.empty() ? "loads" : outcome.message.substr(0, 240));
  EXPECT_LE(outcome.mebibytes, most_mebibytes);
  EXPECT_LE(outcome.seconds, most_seconds);
  if (*tried.words == '\0') {
    EXPECT_EQ(outcome.message, "");
  } else {
    EXPECT_THAT(outcome.message, HasSubstr(crafted.file + ": "));
    EXPECT_THAT(outcome.message, HasSubstr(tried.place));
    EXPECT_THAT(outcome.message, HasSubstr(tried.words));
  }
}

INSTANTIATE_TEST_SUITE_P(Crafted, SmallFile, testing::ValuesIn(cases()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace substep
