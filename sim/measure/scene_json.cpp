#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "sim/loading/scene_settings.h"
#include "sim/measure/json.h"
#include "sim/model/usual_settings.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

Json numbers(const Vector3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

/// Returns a number, or null where it is infinite, which JSON cannot say.
Json finite(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

Json numbers(const Quaternion& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

Json placed(Json shape, const Pose& pose) {
  shape["position"] = numbers(pose.position);
  shape["orientation"] = numbers(pose.orientation);
  return shape;
}

Json points(const std::vector<Vector3>& vertices, const Pose& pose) {
  Json result = Json::array();
  for (const Vector3& vertex : vertices) result.push_back(numbers(pose * vertex));
  return result;
}

Json of_shape(const Sphere& sphere, const Pose& pose) {
  return placed({{"shape", "sphere"}, {"radius", sphere.radius}}, pose);
}
Json of_shape(const Capsule& capsule, const Pose& pose) {
  return placed({{"shape", "capsule"}, {"radius", capsule.radius}, {"height", 2 * capsule.half_length}},
                pose);
}
Json of_shape(const Plane& /*plane*/, const Pose& pose) {
  return placed({{"shape", "plane"}}, pose);
}
Json of_shape(const Polytope& polytope, const Pose& pose) {
  if (polytope.half_box) {
    return placed({{"shape", "box"}, {"size", numbers(2 * *polytope.half_box)}}, pose);
  }
  if (polytope.ellipsoid) {
    return placed({{"shape", "ellipsoid"},
                   {"halfAxes", numbers(*polytope.ellipsoid)},
                   {"vertices", polytope.vertices.size()},
                   {"points", points(polytope.vertices, pose)}},
                  pose);
  }
  return {{"shape", "hull"},
          {"vertices", polytope.vertices.size()},
          {"faces", polytope.face_count()},
          {"points", points(polytope.vertices, pose)}};
}
Json tapered(const char* shape, double height, double bottom, double top, const Pose& pose) {
  return placed({{"shape", shape}, {"height", height}, {"radiusBottom", bottom}, {"radiusTop", top}}, pose);
}
Json of_shape(const Cylinder& x, const Pose& pose) {
  return tapered("cylinder", 2 * x.half_height, x.radius_bottom, x.radius_top, pose);
}
Json of_shape(const TaperedCapsule& x, const Pose& pose) {
  return tapered("tapered capsule", 2 * x.half_length, x.radius_bottom, x.radius_top, pose);
}
Json of_shape(const TriangleMesh& mesh, const Pose& pose) {
  return {{"shape", "triangle mesh"},
          {"triangles", mesh.triangles.size()},
          {"twoSided", mesh.two_sided},
          {"points", points(mesh.vertices, pose)},
          {"indices", mesh.triangles}};
}

/// Returns the mode as files have it; null where they state none.
Json combine_name(Combine combine) {
  constexpr std::array names{"average", "minimum", "maximum", "multiply"};
  return combine == Combine::unstated ? Json() : Json(names.at(static_cast<std::size_t>(combine)));
}

/// Returns the frame of a body's node, moved to the centre of mass, in the body frame. Colliders and joints
/// are given in it.
Pose centre_frame(const Body& body) {
  return {Vector3::Zero(), body.body_from_node.orientation};
}

Json bits(std::uint64_t mask) {
  Json result = Json::array();
  for (int bit = 0; bit < 64; ++bit) {
    if ((mask >> bit & 1U) != 0) result.push_back(bit);
  }
  return result;
}

Json of_collider(const Scene& scene, const Collider& collider) {
  const Pose pose = centre_frame(scene.bodies[collider.body]).inverse() * collider.placement;
  Json result = std::visit([&](const auto& shape) { return of_shape(shape, pose); }, collider.shape);
  result["systems"] = collider.in_no_system ? Json() : bits(collider.member);
  result["exceptSystems"] = bits(~collider.collides_with);
  const ContactMaterial& material = collider.material;
  result["material"] = {{"staticFriction", material.static_friction},
                        {"dynamicFriction", material.dynamic_friction},
                        {"restitution", material.restitution},
                        {"frictionCombine", combine_name(material.friction_combine)},
                        {"restitutionCombine", combine_name(material.restitution_combine)}};
  return result;
}

std::string axes_of(const JointLimit& limit) {
  std::string axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (limit.axes.at(axis)) axes += "xyz"[axis];
  }
  return axes;
}

Json of_joint(const Scene& scene, const Joint& joint) {
  const auto body = [&](int index) { return scene.bodies[index].name; };
  const auto frame = [&](int index, const Pose& pose) {
    return placed(Json::object(), centre_frame(scene.bodies[index]).inverse() * pose);
  };
  // Count them among the world's colliders.
  Json silent = Json::array();
  for (const int collider : joint.silent_colliders) {
    silent.push_back(std::count_if(scene.colliders.begin(), scene.colliders.begin() + collider,
                                   [](const Collider& other) { return other.body == world_body; }));
  }
  Json result{{"name", joint.name},
              {"bodies", {body(joint.body_a), body(joint.body_b)}},
              {"indices", {joint.body_a, joint.body_b}},
              {"frames", {frame(joint.body_a, joint.frame_a), frame(joint.body_b, joint.frame_b)}},
              {"bodiesCollide", joint.enable_collision},
              {"silentColliders", silent},
              {"limits", Json::array()},
              {"drives", Json::array()}};
  for (const JointLimit& limit : joint.limits) {
    result["limits"].push_back({{"type", limit.angular ? "angular" : "linear"},
                                {"axes", axes_of(limit)},
                                {"min", finite(limit.min)},
                                {"max", finite(limit.max)},
                                {"stiffness", limit.stiffness ? Json(*limit.stiffness) : Json()},
                                {"damping", limit.damping}});
  }
  for (const JointDrive& drive : joint.drives) {
    result["drives"].push_back({{"type", drive.angular ? "angular" : "linear"},
                                {"axis", std::string(1, "xyz"[drive.axis])},
                                {"mode", drive.acceleration ? "acceleration" : "force"},
                                {"maxForce", finite(drive.max_force)},
                                {"positionTarget", drive.position_target},
                                {"velocityTarget", drive.velocity_target},
                                {"stiffness", drive.stiffness},
                                {"damping", drive.damping}});
  }
  return result;
}

const char* kind_of(const Body& body) {
  if (body.inverse_mass > 0) return "dynamic";
  return body.is_kinematic() ? "kinematic" : "pivoting";
}

/// Returns the reason why n is not that of most scenes; empty where it is.
std::string reason_of_substeps(const Scene& scene) {
  if (scene.substeps != needed_substeps(scene)) return "as its file says";
  if (scene.substeps == default_settings(Algorithm::a5).substeps) return "";
  if (has_loop(scene, Springs::skip) && scene.substeps == substeps_in_loop) return "as joints close a loop";
  return fmt::format("as its heaviest body is {:.4g} times as heavy as its lightest", mass_ratio(scene));
}

}  // namespace

Json scene_json(const Scene& scene) {
  Json result{{"format", "substep scene 1"},
              {"scene", scene.name},
              {"file", scene.file.string()},
              {"hash", fmt::format("{:016x}", scene.hash)},
              {"gravity", numbers(scene.gravity)},
              {"duration", scene.duration},
              {"step", scene.step},
              {"gyroscopic", scene.gyroscopic},
              {"bodies", Json::array()},
              {"joints", Json::array()},
              {"warnings", scene.warnings}};
  const Settings settings = usual_settings(scene, Algorithm::a5);
  result["default"] = label(usual_settings(scene, Settings{}.algorithm));
  result["substeps"] = {{"count", scene.substeps},
                        {"reason", reason_of_substeps(scene)},
                        {"doubt", doubt_about_substeps(scene, settings)}};
  result["parts"] = Simulation(scene, usual_settings(scene, Algorithm::a1)).equal_parts();
  result["modelled"] = Simulation(scene, settings).modelled();
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    Json entry{{"name", body.name}, {"colliders", Json::array()}};
    if (i > 0) {
      entry["kind"] = kind_of(body);
      entry["mass"] = finite(1 / body.inverse_mass);
      entry["inertia"] = {finite(1 / body.inverse_inertia.x()), finite(1 / body.inverse_inertia.y()),
                          finite(1 / body.inverse_inertia.z())};
      const Pose centre = body.pose * centre_frame(body);
      entry["inertiaOrientation"] = numbers(centre_frame(body).inverse().orientation);
      entry["position"] = numbers(centre.position);
      entry["orientation"] = numbers(centre.orientation);
      entry["linearVelocity"] = numbers(body.linear_velocity);
      entry["angularVelocity"] = numbers(body.angular_velocity);
      entry["gravityFactor"] = body.gravity_factor;
    }
    for (const Collider& collider : scene.colliders) {
      if (collider.body == static_cast<int>(i)) entry["colliders"].push_back(of_collider(scene, collider));
    }
    result["bodies"].push_back(std::move(entry));
  }
  for (const Joint& joint : scene.joints) result["joints"].push_back(of_joint(scene, joint));
  std::size_t triangles = 0;
  for (const Visual& visual : scene.visuals) {
    triangles += scene.meshes[visual.mesh].triangles.size();
  }
  result["drawn"] = {{"meshes", scene.visuals.size()}, {"triangles", triangles}};
  result["camera"] = scene.camera ? Json{{"position", numbers(scene.camera->pose.position)},
                                         {"verticalFieldOfView", scene.camera->vertical_field_of_view}}
                                  : Json();
  return result;
}

}  // namespace substep
