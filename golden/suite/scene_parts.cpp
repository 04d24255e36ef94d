#include "golden/suite/scene_parts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>

#include "sim/math/fnv1a.h"

namespace substep::golden {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t digits = 4;  // of a digest

/// A hash of numbers, in the order in which they are given.
class Digest {
 public:
  Digest& add(double number) {
    // Either zero is nothing.
    const std::uint64_t bits = number == 0 ? 0 : std::bit_cast<std::uint64_t>(number);
    return add_number(bits, 8);
  }
  Digest& add_number(std::uint64_t number, int bytes) {
    hash_ = fnv1a_of_number(number, bytes, hash_);
    return *this;
  }
  template <typename Derived>
  Digest& add(const Eigen::MatrixBase<Derived>& matrix) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
      for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
        add(static_cast<double>(matrix(row, column)));
      }
    }
    return *this;
  }
  Digest& add(const Pose& pose) { return add(pose.position).add(pose.orientation.coeffs()); }
  Digest& add(const std::vector<Vector3>& points) {
    for (const Vector3& point : points) add(point);
    return *this;
  }
  Digest& add(const std::vector<Triangle>& triangles) {
    for (const Triangle& triangle : triangles) {
      for (const std::uint32_t corner : triangle) add_number(corner, 4);
    }
    return *this;
  }

  std::string text() const {
    return fmt::format("{:04x}", (hash_ ^ hash_ >> 16 ^ hash_ >> 32 ^ hash_ >> 48) & 0xffff);
  }

 private:
  std::uint64_t hash_ = fnv1a_start;
};

void add_shape(Digest& digest, const Shape& shape) {
  digest.add_number(shape.index(), 1);
  std::visit(
      [&](const auto& of) {
        using Kind = std::decay_t<decltype(of)>;
        if constexpr (std::is_same_v<Kind, Sphere>) {
          digest.add(of.radius);
        } else if constexpr (std::is_same_v<Kind, Capsule>) {
          digest.add(of.half_length).add(of.radius);
        } else if constexpr (std::is_same_v<Kind, Cylinder>) {
          digest.add(of.half_height).add(of.radius_bottom).add(of.radius_top);
        } else if constexpr (std::is_same_v<Kind, TaperedCapsule>) {
          digest.add(of.half_length).add(of.radius_bottom).add(of.radius_top);
        } else if constexpr (std::is_same_v<Kind, Polytope>) {
          digest.add(of.vertices);
        } else if constexpr (std::is_same_v<Kind, TriangleMesh>) {
          digest.add(of.vertices).add(of.triangles).add_number(of.two_sided ? 1 : 0, 1);
        }
      },
      shape);
}

void add_contact(Digest& digest, const Collider& collider) {
  const ContactMaterial& m = collider.material;
  digest.add(m.static_friction).add(m.dynamic_friction).add(m.restitution);
  digest.add_number(static_cast<std::uint64_t>(m.friction_combine), 1);
  digest.add_number(static_cast<std::uint64_t>(m.restitution_combine), 1);
  digest.add_number(collider.member, 8).add_number(collider.collides_with, 8);
  digest.add_number(collider.in_no_system ? 1 : 0, 1);
}

std::string joint_digest(const Joint& joint) {
  Digest digest;
  digest.add_number(static_cast<std::uint64_t>(joint.body_a), 4);
  digest.add_number(static_cast<std::uint64_t>(joint.body_b), 4);
  digest.add(joint.frame_a).add(joint.frame_b).add_number(joint.enable_collision ? 1 : 0, 1);
  for (const int collider : joint.silent_colliders)
    digest.add_number(static_cast<std::uint64_t>(collider), 4);
  for (const JointLimit& limit : joint.limits) {
    digest.add_number(limit.angular ? 1 : 0, 1).add(limit.min).add(limit.max).add(limit.damping);
    for (const bool axis : limit.axes) digest.add_number(axis ? 1 : 0, 1);
    digest.add(limit.stiffness.value_or(-1));
  }
  for (const JointDrive& drive : joint.drives) {
    digest.add_number(drive.angular ? 1 : 0, 1).add_number(drive.acceleration ? 1 : 0, 1);
    digest.add_number(static_cast<std::uint64_t>(drive.axis), 1).add(drive.max_force);
    digest.add(drive.position_target).add(drive.velocity_target).add(drive.stiffness).add(drive.damping);
  }
  return digest.text();
}

/// Nothing for a surface that has no more than its colour and finish.
void add_appearance(Digest& digest, const Scene& scene, const Surface& surface, const VertexLooks& looks) {
  const bool shines = std::ranges::any_of(surface.emission, [](double level) { return level > 0; });
  if (shines) digest.add(surface.emission[0]).add(surface.emission[1]).add(surface.emission[2]);
  if (surface.is_unlit) digest.add_number(1, 1);
  if (surface.opacity != Surface::Opacity::opaque) {
    digest.add_number(static_cast<std::uint64_t>(surface.opacity), 1).add(surface.alpha).add(surface.cut_off);
  }
  for (const Texture& texture : surface.textures) {
    if (texture.image < 0) continue;
    digest.add_number(fnv1a(*scene.images[static_cast<std::size_t>(texture.image)].bytes), 8);
    digest.add(texture.turn).add(texture.offset);
    for (const auto& place : looks.texture_coordinates[static_cast<std::size_t>(texture.coordinates)]) {
      digest.add(place[0]).add(place[1]);
    }
  }
  for (const auto& color : looks.colors) {
    for (const float level : color) digest.add(level);
  }
}

void add_visual(Digest& digest, const Scene& scene, const Visual& visual) {
  const Mesh& mesh = scene.meshes[static_cast<std::size_t>(visual.mesh)];
  digest.add(mesh.positions).add(mesh.normals).add(mesh.triangles);
  digest.add(visual.linear).add(visual.translation);
  if (mesh.surface < 0) return;
  const Surface& surface = scene.surfaces[static_cast<std::size_t>(mesh.surface)];
  for (const double level : surface.base_color) digest.add(level);
  digest.add(surface.metallic).add(surface.roughness);
  add_appearance(digest, scene, surface, mesh.looks);
}

/// The digests of all bodies, made by `add(digest, index)`.
template <typename Add>
std::string of_bodies(const Scene& scene, Add&& add) {
  std::string text;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    Digest digest;
    add(digest, static_cast<int>(i));
    text += digest.text();
  }
  return text;
}

const Body& body_of(const Scene& scene, int body) {
  return scene.bodies[static_cast<std::size_t>(body)];
}

std::string light_and_camera(const Scene& scene) {
  Digest camera;
  if (scene.camera) camera.add(scene.camera->pose).add(scene.camera->vertical_field_of_view);
  Digest light;
  if (scene.sun) {
    light.add(scene.sun->direction).add(scene.sun->illuminance);
    for (const double level : scene.sun->color) light.add(level);
  }
  for (const Light& other : scene.lights) {
    light.add(other.position).add(other.direction).add(other.intensity);
    for (const double level : other.color) light.add(level);
  }
  return camera.text() + light.text();
}

/// A kind of part: its key in the sidecar, how it is called, and what it bears on.
struct Kind {
  const char* key;
  const char* text;
  bool moves;
  bool is_drawn;
};
constexpr std::array<Kind, 5> body_kinds{{{"mass", "mass or inertia", true, false},
                                          {"start", "start", true, true},
                                          {"shapes", "collider", true, true},
                                          {"contact", "contact material or filter", true, false},
                                          {"drawn", "mesh or colour", false, true}}};

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t most = 4;
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + most, ", "),
                     names.size() - most);
}

/// Which of the digests in two strings of equal length differ, by name.
std::vector<std::string> differing(const std::string& noted, const std::string& here,
                                   const std::vector<std::string>& names) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i * digits < here.size(); ++i) {
    if (noted.compare(i * digits, digits, here, i * digits, digits) == 0) continue;
    result.push_back(i < names.size() ? names[i] : fmt::format("number {}", i));
  }
  return result;
}

class Comparison {
 public:
  Comparison(const Json& noted, const Scene& scene) : noted_(noted), here_(scene_parts(scene)) {}

  void say(const Kind& kind, const std::string& what) {
    result.moves = result.moves || kind.moves;
    result.is_drawn = result.is_drawn || kind.is_drawn;
    result.text += (result.text.empty() ? "" : "; ") + what;
  }

  void compare_list(const Kind& kind, const std::vector<std::string>& names) {
    const std::string before = noted_.value(kind.key, std::string());
    const std::string after = here_.at(kind.key);
    if (before == after) return;
    if (before.size() != after.size()) {
      return say(kind, fmt::format("{}: {} there, {} here", kind.text, before.size() / digits,
                                   after.size() / digits));
    }
    say(kind, fmt::format("{} of {}", kind.text, listed(differing(before, after, names))));
  }

  SceneDifference result;

 private:
  const Json& noted_;
  Json here_;
};

/// Bodies by their names: those that are gone and those that are new.
void compare_names(const std::vector<std::string>& before, const std::vector<std::string>& after,
                   Comparison& comparison) {
  const auto without = [](const std::vector<std::string>& all, const std::vector<std::string>& known) {
    std::vector<std::string> rest;
    for (const std::string& name : all) {
      if (std::find(known.begin(), known.end(), name) == known.end()) rest.push_back(name);
    }
    return rest;
  };
  const Kind bodies{"", "", true, true};
  const auto gone = without(before, after);
  const auto fresh = without(after, before);
  if (!gone.empty()) comparison.say(bodies, "gone: " + listed(gone));
  if (!fresh.empty()) comparison.say(bodies, "new: " + listed(fresh));
  if (gone.empty() && fresh.empty()) {
    comparison.say(bodies, fmt::format("{} bodies there, {} here", before.size() - 1, after.size() - 1));
  }
}

}  // namespace

Json scene_parts(const Scene& scene) {
  Json parts;
  Digest world;
  world.add(scene.gravity).add(scene.step).add_number(scene.gyroscopic ? 1 : 0, 1);
  parts["world"] = world.text();
  parts["view"] = light_and_camera(scene);
  parts["mass"] = of_bodies(scene, [&](Digest& digest, int i) {
    const Body& body = body_of(scene, i);
    digest.add(body.inverse_mass).add(body.inverse_inertia).add(body.gravity_factor);
  });
  parts["start"] = of_bodies(scene, [&](Digest& digest, int i) {
    const Body& body = body_of(scene, i);
    digest.add(body.body_from_node).add(body.pose).add(body.linear_velocity).add(body.angular_velocity);
  });
  const auto of_colliders = [&](auto&& add) {
    return of_bodies(scene, [&](Digest& digest, int i) {
      for (const Collider& collider : scene.colliders) {
        if (collider.body == i) add(digest, collider);
      }
    });
  };
  parts["shapes"] = of_colliders([](Digest& digest, const Collider& collider) {
    add_shape(digest, collider.shape);
    digest.add(collider.placement);
  });
  parts["contact"] = of_colliders(add_contact);
  parts["drawn"] = of_bodies(scene, [&](Digest& digest, int i) {
    for (const Visual& visual : scene.visuals) {
      if (visual.body == i) add_visual(digest, scene, visual);
    }
  });
  std::string joints;
  for (const Joint& joint : scene.joints) joints += joint_digest(joint);
  parts["joints"] = joints;
  return parts;
}

SceneDifference scene_difference(const Json& noted, const Scene& scene,
                                 const std::vector<std::string>& names) {
  Comparison comparison(noted, scene);
  std::vector<std::string> bodies;
  for (const Body& body : scene.bodies) bodies.push_back(body.name);
  bodies.front() = "the world";
  std::vector<std::string> before = names.empty() ? bodies : names;
  before.front() = bodies.front();
  comparison.compare_list({"world", "gravity or step", true, false}, {"the scene"});
  comparison.compare_list({"view", "placement or strength", false, true}, {"camera", "light"});
  if (noted.value("mass", std::string()).size() == bodies.size() * digits) {
    for (const Kind& kind : body_kinds) comparison.compare_list(kind, bodies);
  } else {
    compare_names(before, bodies, comparison);
  }
  std::vector<std::string> joints;
  for (const Joint& joint : scene.joints) joints.push_back(joint.name);
  comparison.compare_list({"joints", "joint", true, false}, joints);
  return std::move(comparison.result);
}

}  // namespace substep::golden
