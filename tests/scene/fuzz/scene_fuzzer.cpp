/// A fuzz target that loads any bytes as a scene's file, which must load or be refused with a message. With
/// clang: cmake --preset fuzz, then build-fuzz/tests/scene/fuzz/scene_fuzzer with
/// -dict=tests/scene/fuzz/gltf.dict, a folder for what it finds, and tests/scene/fuzz/corpus.
///
/// Bytes that begin with "glTF" are a .glb. Others are a .gltf, unless their first line is "mesh." and a
/// format's name: then the rest is a file of that format.

#include "tests/scene/fuzz/scene_fuzzer.h"

#include <cmath>
#include <cstdint>
#include <string>

#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"
#include "tests/fuzz_corpus.h"

namespace substep {
namespace {

using test::require;

bool is_sound(const Pose& pose) {
  return pose.position.allFinite() && std::fabs(pose.orientation.norm() - 1) < 1e-9;
}

void check(const Scene& scene) {
  const int bodies = static_cast<int>(scene.bodies.size());
  require(bodies >= 1 && scene.step > 0 && scene.duration > 0 && scene.gravity.allFinite(), "its settings");
  for (const Body& body : scene.bodies) {
    require(std::isfinite(body.inverse_mass) && body.inverse_mass >= 0, "a mass");
    require(body.inverse_inertia.allFinite() && body.inverse_inertia.minCoeff() >= 0, "an inertia");
    require(is_sound(body.pose) && is_sound(body.body_from_node), "a pose");
    require(body.linear_velocity.allFinite() && body.angular_velocity.allFinite(), "a velocity");
  }
  for (const Collider& collider : scene.colliders) {
    require(collider.body >= 0 && collider.body < bodies, "a collider's body");
    require(is_sound(collider.placement), "a collider's placement");
    if (const auto* polytope = std::get_if<Polytope>(&collider.shape)) {
      for (const Vector3& vertex : polytope->vertices) require(vertex.allFinite(), "a hull");
    }
  }
  for (const Joint& joint : scene.joints) {
    require(joint.body_a >= 0 && joint.body_a < bodies && joint.body_b >= 0 && joint.body_b < bodies &&
                joint.body_a != joint.body_b,
            "a joint's bodies");
    require(is_sound(joint.frame_a) && is_sound(joint.frame_b), "a joint's frames");
  }
  for (const Mesh& mesh : scene.meshes) {
    require(mesh.normals.size() == mesh.positions.size(), "a mesh's normals");
    require(mesh.surface >= -1 && mesh.surface < static_cast<int>(scene.surfaces.size()), "a mesh's surface");
    for (const Vector3& position : mesh.positions) require(position.allFinite(), "a mesh's positions");
    for (const Vector3& normal : mesh.normals) require(std::fabs(normal.norm() - 1) < 1e-12, "a normal");
    for (const Triangle& triangle : mesh.triangles) {
      for (const std::uint32_t corner : triangle) require(corner < mesh.positions.size(), "a triangle");
    }
  }
  for (const Visual& visual : scene.visuals) {
    require(visual.mesh >= 0 && visual.mesh < static_cast<int>(scene.meshes.size()) && visual.body >= 0 &&
                visual.body < bodies,
            "a visual's mesh or body");
    require(visual.linear.allFinite() && visual.translation.allFinite(), "a visual's transform");
  }
  if (scene.camera) require(is_sound(scene.camera->pose), "the camera");
}

}  // namespace

bool loads_or_is_refused(std::string_view bytes) {
  std::string name = "scene.gltf";
  if (bytes.substr(0, 4) == "glTF") name = "scene.glb";
  if (bytes.substr(0, 5) == "mesh.") {
    const std::size_t end = bytes.substr(0, 16).find('\n');
    if (end == std::string_view::npos) return false;
    name = bytes.substr(0, end);
    if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789.") != std::string::npos) return false;
    bytes.remove_prefix(end + 1);
  }
  const std::optional<std::string> message =
      test::refusal(name, bytes, [](const auto& file) { check(load_scene(file)); });
  require(!message || message->find(name) != std::string::npos, "a refusal does not name the file");
  require(!message || message->find('\n') == std::string::npos, "a refusal has more than one line");
  return !message;
}

}  // namespace substep

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  substep::loads_or_is_refused({reinterpret_cast<const char*>(data), size});
  return 0;
}
