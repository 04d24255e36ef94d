/// Bytes changed at random, the same ones every time: a file loads or is refused, and nothing else happens.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "tests/scene/example_scene.h"

namespace substep {
namespace {

using namespace test;

// Expects numbers that can be computed with in every scene that loads.
void expect_sound(const Scene& scene) {
  for (const Body& body : scene.bodies) {
    EXPECT_TRUE(std::isfinite(body.inverse_mass) && body.inverse_mass >= 0);
    EXPECT_TRUE(body.inverse_inertia.allFinite());
    EXPECT_TRUE(body.pose.position.allFinite());
    EXPECT_NEAR(body.pose.orientation.norm(), 1, 1e-12);
  }
  const int bodies = static_cast<int>(scene.bodies.size());
  for (const Collider& collider : scene.colliders) {
    EXPECT_TRUE(collider.body >= 0 && collider.body < bodies);
    EXPECT_TRUE(collider.placement.position.allFinite());
  }
  for (const Joint& joint : scene.joints) EXPECT_TRUE(joint.body_a < bodies && joint.body_b < bodies);
  for (const Mesh& mesh : scene.meshes) {
    EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
    EXPECT_LT(mesh.surface, static_cast<int>(scene.surfaces.size()));
    for (const Vector3& position : mesh.positions) EXPECT_TRUE(position.allFinite());
    for (const Vector3& normal : mesh.normals) EXPECT_NEAR(normal.norm(), 1, 1e-12);
    for (const Triangle& triangle : mesh.triangles) {
      for (const std::uint32_t index : triangle) EXPECT_LT(index, mesh.positions.size());
    }
  }
}

// Loads 500 mutants; returns how many loaded.
int mutate(const std::string& original, const std::string& name) {
  const TemporaryFolder folder;
  std::mt19937 random(20261121);
  const auto below = [&](std::size_t bound) { return random() % bound; };
  int loaded = 0;
  for (int mutant = 0; mutant < 500; ++mutant) {
    std::string bytes = original;
    for (std::size_t change = 0, changes = 1 + below(3); change < changes; ++change) {
      const std::size_t at = below(bytes.size());
      switch (below(4)) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes[at] = static_cast<char>(bytes[at] ^ 1 << below(7));
          break;
        case 2:
          bytes[at] = "0123456789-eE.,:[]{}\""[below(21)];
          break;
        default:
          bytes.erase(at, 1);
          break;
      }
    }
    try {
      expect_sound(load_scene(folder.write(name, bytes)));
      ++loaded;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
    if (testing::Test::HasFailure()) {
      ADD_FAILURE() << "mutant " << mutant << " of " << name;
      break;
    }
  }
  return loaded;
}

TEST(Mutation, DamagedGltfDoesNoHarm) {
  const int loaded = mutate(example().dump(1), "mutant.gltf");
  EXPECT_GT(loaded, 30);  // measured 73: else nothing but the parser was tested
  EXPECT_LT(loaded, 450);
}

TEST(Mutation, DamagedGlbDoesNoHarm) {
  nlohmann::json document = example();
  document["buffers"][0].erase("uri");
  const int loaded = mutate(glb(document.dump(), cube_buffer()), "mutant.glb");
  EXPECT_GT(loaded, 20);  // measured 46
  EXPECT_LT(loaded, 450);
}

}  // namespace
}  // namespace substep
