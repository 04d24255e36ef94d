#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "sim/error.h"
#include "sim/study/engines/engine_scene.h"

namespace substep {
namespace {

/// A body and the joint that connects it to its parent in the tree.
struct EngineLink {
  int body;
  int parent;                ///< the world, or a body of an earlier link
  const EngineJoint* joint;  ///< null: it is free, and its parent is the world
  bool is_a;                 ///< whether `body` is the joint's a
};

/// Returns parents before children. Joints that close a loop go to `closing`.
std::vector<EngineLink> tree_of(const Scene& scene, const std::vector<EngineJoint>& joints,
                                std::vector<const EngineJoint*>& closing) {
  std::vector<EngineLink> links;
  std::vector<bool> placed(scene.bodies.size(), false);
  std::vector<bool> used(joints.size(), false);
  std::deque<int> reached{world_body};
  placed[world_body] = true;
  const auto follow = [&] {
    while (!reached.empty()) {
      const int parent = reached.front();
      reached.pop_front();
      for (std::size_t i = 0; i < joints.size(); ++i) {
        if (used[i] || (joints[i].a != parent && joints[i].b != parent)) continue;
        used[i] = true;
        const bool is_a = joints[i].b == parent;
        const int child = is_a ? joints[i].a : joints[i].b;
        if (placed[child]) {
          closing.push_back(&joints[i]);
          continue;
        }
        placed[child] = true;
        links.push_back({child, parent, &joints[i], is_a});
        reached.push_back(child);
      }
    }
  };
  follow();
  for (int body = 1; body < std::ssize(scene.bodies); ++body) {
    if (placed[body] || scene.bodies[body].inverse_mass == 0) continue;
    placed[body] = true;
    links.push_back({body, world_body, nullptr, true});
    reached.push_back(body);
    follow();
  }
  return links;
}

/// Returns the joint's anchor in the frame of the link's body.
Vector3 anchor_of_body(const EngineLink& link) {
  return link.is_a ? link.joint->anchor_a : link.joint->anchor_b;
}
Vector3 axis_of_body(const EngineLink& link) {
  return link.is_a ? link.joint->axis_a : link.joint->axis_b;
}

std::string numbers(const Vector3& v) {
  return fmt::format("{} {} {}", v.x(), v.y(), v.z());
}
std::string numbers(const Quaternion& q) {
  return fmt::format("{} {} {} {}", q.w(), q.x(), q.y(), q.z());
}
std::string placed(const Pose& pose) {
  return fmt::format("pos=\"{}\" quat=\"{}\"", numbers(pose.position), numbers(pose.orientation));
}

/// A writer of the scene as MuJoCo XML. Body i is named "b<i>".
class MujocoText {
 public:
  MujocoText(const Scene& scene, const EngineScene& shared, const Settings& settings,
             const std::string& integrator)
      : scene_(scene), shared_(shared), links_(tree_of(scene, shared.joints, closing_)) {
    if (!scene.gyroscopic) throw Error("its gyroscopic term cannot be left out");
    text_ = fmt::format(
        "<mujoco><compiler angle=\"radian\" inertiafromgeom=\"false\" boundmass=\"0\"/>"
        "<option timestep=\"{}\" integrator=\"{}\" gravity=\"{}\"/><worldbody>",
        settings.step, integrator, numbers(scene.gravity));
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      if (i == world_body || scene.bodies[i].inverse_mass == 0)
        add_colliders(static_cast<int>(i), scene.bodies[i].pose);
    }
    for (const EngineLink& link : links_) {
      if (link.parent == world_body) add(link);
    }
    text_ += "</worldbody><equality>";
    for (const EngineJoint* joint : closing_) close(*joint);
    text_ += "</equality></mujoco>";
  }
  const std::string& text() const { return text_; }
  const std::vector<EngineLink>& links() const { return links_; }

 private:
  void add_colliders(int body, const Pose& outer) {
    if (!shared_.has_contacts) return;
    for (const Collider& collider : scene_.colliders) {
      if (collider.body != body) continue;
      Pose placement = outer * collider.placement;
      // Capsules lie along z, a plane's normal is z.
      const Quaternion y_to_z(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);
      std::string shape;
      if (const auto* polytope = std::get_if<Polytope>(&collider.shape); polytope && polytope->half_box) {
        shape = fmt::format("box\" size=\"{}\"", numbers(*polytope->half_box));
      } else if (const auto* sphere = std::get_if<Sphere>(&collider.shape)) {
        shape = fmt::format("sphere\" size=\"{}\"", sphere->radius);
      } else if (const auto* capsule = std::get_if<Capsule>(&collider.shape)) {
        shape = fmt::format("capsule\" size=\"{} {}\"", capsule->radius, capsule->half_length);
        placement.orientation = placement.orientation * y_to_z;
      } else if (std::holds_alternative<Plane>(collider.shape)) {
        shape = "plane\" size=\"0 0 1\"";
        placement.orientation = placement.orientation * y_to_z;
      } else {
        throw Error("a collider is no box, sphere, capsule or plane");
      }
      text_ += fmt::format("<geom type=\"{} friction=\"{} 0 0\" condim=\"3\" {}/>", shape, shared_.friction,
                           placed(placement));
    }
  }

  void add(const EngineLink& link) {
    const Body& body = scene_.bodies[link.body];
    const Pose pose =
        link.parent == world_body ? body.pose : scene_.bodies[link.parent].pose.inverse() * body.pose;
    text_ += fmt::format("<body name=\"b{}\" {}><inertial pos=\"0 0 0\" mass=\"{}\" diaginertia=\"{}\"/>",
                         link.body, placed(pose), 1 / body.inverse_mass,
                         numbers(Vector3(body.inverse_inertia.cwiseInverse())));
    if (!link.joint) {
      text_ += "<freejoint/>";
    } else if (link.joint->kind == EngineJoint::Kind::ball) {
      text_ += fmt::format("<joint type=\"ball\" pos=\"{}\"/>", numbers(anchor_of_body(link)));
    } else if (link.joint->kind == EngineJoint::Kind::hinge) {
      text_ += fmt::format("<joint type=\"hinge\" pos=\"{}\" axis=\"{}\"/>", numbers(anchor_of_body(link)),
                           numbers(axis_of_body(link)));
    }
    add_colliders(link.body, Pose{});
    for (const EngineLink& child : links_) {
      if (child.parent == link.body) add(child);
    }
    text_ += "</body>";
  }

  /// Adds a joint that closes a loop, as equality constraints (a hinge: two points), without contacts.
  void close(const EngineJoint& joint) {
    std::string names = fmt::format("body1=\"b{}\"", joint.a);
    if (joint.b != world_body) {
      names += fmt::format(" body2=\"b{}\"", joint.b);
      text_ += fmt::format("</equality><contact><exclude {}/></contact><equality>", names);
    }
    const auto connect = [&](const Vector3& anchor) {
      text_ += fmt::format("<connect {} anchor=\"{}\"/>", names, numbers(anchor));
    };
    if (joint.kind == EngineJoint::Kind::fixed) {
      text_ += fmt::format("<weld {}/>", names);
      return;
    }
    connect(joint.anchor_a);
    if (joint.kind == EngineJoint::Kind::hinge) connect(joint.anchor_a + joint.axis_a);
  }

  const Scene& scene_;
  const EngineScene& shared_;
  std::vector<const EngineJoint*> closing_;  ///< before links_, which fills it
  std::vector<EngineLink> links_;
  std::string text_;
};

class MujocoStepper final : public Stepper {
 public:
  MujocoStepper(const Scene& scene, const EngineScene& shared, const Settings& settings,
                const std::string& integrator)
      : state_(initial_state(scene)) {
    const MujocoText text(scene, shared, settings, integrator);
    load(text.text());
    data_ = mj_makeData(model_);
    for (const EngineLink& link : text.links()) {
      const int id = mj_name2id(model_, mjOBJ_BODY, fmt::format("b{}", link.body).c_str());
      bodies_.emplace_back(link.body, id);
      start(scene, link, id);
    }
    mj_forward(model_, data_);
  }
  ~MujocoStepper() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  MujocoStepper(const MujocoStepper&) = delete;
  MujocoStepper& operator=(const MujocoStepper&) = delete;

  bool step() override {
    mj_step(model_, data_);
    mj_kinematics(model_, data_);  // mj_step leaves the poses of its start
    mj_comPos(model_, data_);
    mj_comVel(model_, data_);
    for (const auto& [body, id] : bodies_) {
      const mjtNum* p = data_->xpos + 3 * id;
      const mjtNum* q = data_->xquat + 4 * id;
      mjtNum velocity[6];
      mj_objectVelocity(model_, data_, mjOBJ_XBODY, id, velocity, 0);
      next_.q[body] = {{p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}};
      next_.v[body] = {{velocity[3], velocity[4], velocity[5]}, {velocity[0], velocity[1], velocity[2]}};
    }
    // Detect divergence by MuJoCo's warning: it then resets the scene.
    const bool went_wrong = data_->warning[mjWARN_BADQPOS].number > 0 ||
                            data_->warning[mjWARN_BADQVEL].number > 0 ||
                            data_->warning[mjWARN_BADQACC].number > 0;
    if (went_wrong || !is_finite(next_)) return false;
    state_ = next_;
    return true;
  }
  const State& state() const override { return state_; }

 private:
  void load(const std::string& text) {
    mju_user_warning = [](const char*) {};  // the default writes a log file to the working folder
    mjVFS files;
    mj_defaultVFS(&files);
    mj_makeEmptyFileVFS(&files, "scene.xml", static_cast<int>(text.size()));
    std::copy(text.begin(), text.end(), static_cast<char*>(files.filedata[0]));
    char message[1000] = "";
    model_ = mj_loadXML("scene.xml", &files, message, sizeof message);
    mj_deleteVFS(&files);
    if (!model_) throw Error("MuJoCo refuses it: {}", message);
  }

  void start(const Scene& scene, const EngineLink& link, int id) {
    const Body& body = scene.bodies[link.body];
    const int degrees = model_->body_dofadr[id];
    if (degrees < 0) return;
    mjtNum* const v = data_->qvel + degrees;
    // Relative to the parent, in the body's frame.
    const Vector3 relative = body.angular_velocity - scene.bodies[link.parent].angular_velocity;
    const Vector3 spin = body.pose.orientation.conjugate() * relative;
    if (!link.joint) {
      for (int k = 0; k < 3; ++k) v[k] = body.linear_velocity[k];
      for (int k = 0; k < 3; ++k) v[3 + k] = spin[k];
    } else if (link.joint->kind == EngineJoint::Kind::ball) {
      for (int k = 0; k < 3; ++k) v[k] = spin[k];
    } else {
      v[0] = spin.dot(axis_of_body(link));
    }
  }

  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  std::vector<std::pair<int, int>> bodies_;  ///< ours and MuJoCo's
  State state_;
  State next_ = state_;
};

}  // namespace

Stepper* make_engine_stepper(const Scene& scene, const EngineScene& shared, const Settings& settings,
                             const std::string& solver) {
  return std::make_unique<MujocoStepper>(scene, shared, settings, solver).release();
}

}  // namespace substep
