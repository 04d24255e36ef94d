#include "golden/suite/sidecar.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <type_traits>

#include "render/body_mesh.h"

namespace substep::golden {
namespace {

constexpr std::size_t digits = 4;  // of a digest

std::string text_of(const Digest& digest) {
  return fmt::format("{:04x}", digest.value());
}

void add_pose(Digest& digest, const Pose& pose) {
  digest.add(pose.position, pose.orientation.coeffs());
}

void add_shape(Digest& digest, const Collider& collider) {
  digest.add(static_cast<std::uint8_t>(collider.shape.index()));
  std::visit(
      [&](const auto& shape) {
        using Kind = std::decay_t<decltype(shape)>;
        if constexpr (std::is_same_v<Kind, Sphere>) {
          digest.add(shape.radius);
        } else if constexpr (std::is_same_v<Kind, Capsule>) {
          digest.add(shape.half_length, shape.radius);
        } else if constexpr (std::is_same_v<Kind, Cylinder>) {
          digest.add(shape.half_height, shape.radius_bottom, shape.radius_top);
        } else if constexpr (std::is_same_v<Kind, TaperedCapsule>) {
          digest.add(shape.half_length, shape.radius_bottom, shape.radius_top);
        } else if constexpr (std::is_same_v<Kind, Polytope>) {
          digest.add(shape.vertices);
        } else if constexpr (std::is_same_v<Kind, TriangleMesh>) {
          digest.add(shape.vertices, shape.triangles, shape.two_sided);
        }
      },
      collider.shape);
  add_pose(digest, collider.placement);
}

void add_contact(Digest& digest, const Collider& collider) {
  const ContactMaterial& m = collider.material;
  // Digests of approved goldens treat a missing mode as average.
  const auto mode_of = [](Combine mode) { return mode == Combine::unstated ? Combine::average : mode; };
  digest.add(m.static_friction, m.dynamic_friction, m.restitution, mode_of(m.friction_combine),
             mode_of(m.restitution_combine));
  digest.add(collider.member, collider.collides_with, collider.in_no_system);
}

std::string joint_digest(const Joint& joint) {
  Digest digest;
  digest.add(joint.body_a, joint.body_b);
  add_pose(digest, joint.frame_a);
  add_pose(digest, joint.frame_b);
  digest.add(joint.enable_collision, joint.silent_colliders);
  for (const JointLimit& limit : joint.limits) {
    digest.add(limit.angular, limit.min, limit.max, limit.damping, limit.axes);
    digest.add(limit.stiffness.value_or(-1));
  }
  for (const JointDrive& drive : joint.drives) {
    digest.add(drive.angular, drive.acceleration, static_cast<std::uint8_t>(drive.axis), drive.max_force);
    digest.add(drive.position_target, drive.velocity_target, drive.stiffness, drive.damping);
  }
  return text_of(digest);
}

/// Adds the appearance to the digest. `has_looks`: render::needs_looks() of the scene.
void add_appearance(Digest& digest, const Scene& scene, const Surface& surface,
                    const VertexAttributes& attributes, bool has_looks) {
  if (std::ranges::max(surface.emission) > 0) digest.add(surface.emission);
  if (has_looks) digest.add(surface.is_double_sided);
  if (surface.is_unlit) digest.add(true);
  if (surface.opacity != Surface::Opacity::opaque)
    digest.add(surface.opacity, surface.alpha, surface.cut_off);
  for (std::size_t role = 0; role < surface.textures.size(); ++role) {
    const Texture& texture = surface.textures[role];
    if (texture.image < 0) continue;
    digest.add(role, fnv1a(*scene.images[static_cast<std::size_t>(texture.image)].bytes));
    digest.add(texture.uv_matrix, texture.offset, surface.normal_scale, surface.occlusion_strength);
    digest.add(texture.wrap, texture.is_sharp_near, texture.is_sharp_far, texture.levels);
    digest.add(attributes.texture_coordinates[static_cast<std::size_t>(texture.coordinates)]);
  }
  digest.add(attributes.colors, attributes.tangents);
}

void add_visual(Digest& digest, const Scene& scene, const Visual& visual, bool has_looks) {
  const Mesh& mesh = scene.meshes[static_cast<std::size_t>(visual.mesh)];
  digest.add(mesh.positions, mesh.normals, mesh.triangles, visual.linear, visual.translation);
  if (mesh.surface < 0) return;
  const Surface& surface = scene.surfaces[static_cast<std::size_t>(mesh.surface)];
  digest.add(surface.base_color, surface.metallic, surface.roughness);
  add_appearance(digest, scene, surface, mesh.attributes, has_looks);
}

/// Returns the digests of all bodies, made by `add(digest, index)`.
template <typename Add>
std::string of_bodies(const Scene& scene, Add&& add) {
  std::string text;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    Digest digest;
    add(digest, i);
    text += text_of(digest);
  }
  return text;
}

/// Returns the digests of all bodies, made by `add(digest, member)` of a body's colliders or visuals.
template <typename Member, typename Add>
std::string of_members(const Scene& scene, const std::vector<Member>& members, Add&& add) {
  return of_bodies(scene, [&](Digest& digest, std::size_t i) {
    for (const Member& member : members) {
      if (member.body == static_cast<int>(i)) add(digest, member);
    }
  });
}

std::string light_and_camera(const Scene& scene) {
  Digest camera;
  if (scene.camera) {
    add_pose(camera, scene.camera->pose);
    camera.add(scene.camera->vertical_field_of_view);
  }
  Digest light;
  if (scene.sun) light.add(scene.sun->direction, scene.sun->illuminance, scene.sun->color);
  for (const Light& other : scene.lights) {
    light.add(other.position, other.direction, other.intensity, other.color);
    light.add(static_cast<std::uint8_t>(other.kind), other.range, other.inner_angle, other.outer_angle);
  }
  return text_of(camera) + text_of(light);
}

/// A kind of part: its key in the sidecar, its name, and whether motion or pictures depend on it.
struct Kind {
  const char* key;
  const char* text;
  bool moves;
  bool is_drawn;
};
constexpr std::array<Kind, 5> body_kinds{{{"mass", "mass, inertia or gravity factor", true, false},
                                          {"start", "initial pose or velocity", true, true},
                                          {"shapes", "collider", true, true},
                                          {"contact", "contact material or filter", true, false},
                                          {"drawn", "mesh or colour", false, true}}};

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t most = 4;
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + most, ", "),
                     names.size() - most);
}

/// Returns the names of the digests that differ between two strings of equal length.
std::vector<std::string> differing(const std::string& noted, const std::string& here,
                                   const std::vector<std::string>& names) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (noted.compare(i * digits, digits, here, i * digits, digits) != 0) result.push_back(names[i]);
  }
  return result;
}

/// Returns the entries of `all` that are not in `known`.
std::vector<std::string> without(std::vector<std::string> all, const std::vector<std::string>& known) {
  std::erase_if(all, [&](const std::string& name) { return std::ranges::find(known, name) != known.end(); });
  return all;
}

template <typename Item>
std::vector<std::string> names_of(const std::vector<Item>& items) {
  std::vector<std::string> names;
  for (const Item& item : items) names.push_back(item.name);
  return names;
}

}  // namespace

Json scene_parts(const Scene& scene) {
  Json parts;
  parts["world"] = text_of(Digest().add(scene.gravity, scene.step, scene.gyroscopic));
  parts["view"] = light_and_camera(scene);
  parts["mass"] = of_bodies(scene, [&](Digest& digest, std::size_t i) {
    const Body& body = scene.bodies[i];
    digest.add(body.inverse_mass, body.inverse_inertia, body.gravity_factor);
  });
  parts["start"] = of_bodies(scene, [&](Digest& digest, std::size_t i) {
    const Body& body = scene.bodies[i];
    add_pose(digest, body.body_from_node);
    add_pose(digest, body.pose);
    digest.add(body.linear_velocity, body.angular_velocity);
  });
  parts["shapes"] = of_members(scene, scene.colliders, add_shape);
  parts["contact"] = of_members(scene, scene.colliders, add_contact);
  const bool has_looks = render::needs_looks(scene);
  parts["drawn"] = of_members(scene, scene.visuals, [&](Digest& digest, const Visual& visual) {
    add_visual(digest, scene, visual, has_looks);
  });
  std::string joints;
  for (const Joint& joint : scene.joints) joints += joint_digest(joint);
  parts["joints"] = joints;
  return parts;
}

SceneDifference scene_difference(const Json& noted, const Scene& scene,
                                 const std::vector<std::string>& names) {
  const Json here = scene_parts(scene);
  SceneDifference result;
  const auto add = [&](const Kind& kind, const std::string& what) {
    result.moves = result.moves || kind.moves;
    result.is_drawn = result.is_drawn || kind.is_drawn;
    result.text += (result.text.empty() ? "" : "; ") + what;
  };
  const auto compare = [&](const Kind& kind, const std::vector<std::string>& items) {
    const std::string golden = noted.value(kind.key, std::string());
    const std::string now = here.at(kind.key);
    if (golden.size() != now.size()) {
      add(kind, fmt::format("{}: {} in the golden, {} now", kind.text, golden.size() / digits,
                            now.size() / digits));
    } else if (golden != now) {
      add(kind, fmt::format("{} of {}", kind.text, listed(differing(golden, now, items))));
    }
  };
  std::vector<std::string> bodies = names_of(scene.bodies);
  bodies.front() = "the world";
  std::vector<std::string> before = names.empty() ? bodies : names;
  before.front() = bodies.front();
  compare({"world", "gravity, step or gyroscopic term", true, false}, {"the scene"});
  compare({"view", "pose, field of view, brightness or colour", false, true}, {"camera", "light"});
  // Compare body by body where there are equally many; list those that are gone or new otherwise.
  if (noted.value("mass", std::string()).size() == bodies.size() * digits) {
    for (const Kind& kind : body_kinds) compare(kind, bodies);
  } else {
    const Kind kind{"", "", true, true};
    const auto gone = without(before, bodies);
    const auto added = without(bodies, before);
    if (!gone.empty()) add(kind, "gone: " + listed(gone));
    if (!added.empty()) add(kind, "new: " + listed(added));
    if (gone.empty() && added.empty())
      add(kind, fmt::format("{} bodies in the golden, {} now", before.size() - 1, bodies.size() - 1));
  }
  compare({"joints", "joint", true, false}, names_of(scene.joints));
  return result;
}

}  // namespace substep::golden
