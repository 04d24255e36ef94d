#include "sim/measure/claims_measurement.h"

#include "sim/algorithms.h"
#include "sim/loading/load_scene.h"
#include "sim/math/rotation.h"

namespace substep::claims {
namespace {

/// Returns the scene with every body in a motion of its own, in space; joints that were closed stay closed.
Scene tumbling(Scene scene) {
  Scene turned = disturbed(scene, 7, 1);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) turned.bodies[i].pose = scene.bodies[i].pose;
  // Run A1 at small steps: it removes velocities that the joints forbid, and leads out of the plane.
  const State state = measured_run(turned, {.algorithm = Algorithm::a1, .step = 1.0 / 61440}, 0.2).state;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    scene.bodies[i].pose = {state.q[i].linear, state.q[i].angular};
    scene.bodies[i].linear_velocity = state.v[i].linear;
    scene.bodies[i].angular_velocity = state.v[i].angular;
  }
  return scene;
}

}  // namespace

Settings settings_of(const Scene& scene, Algorithm algorithm, int n, int m, Joints joints) {
  return {.algorithm = algorithm, .step = scene.step, .substeps = n, .iterations = m, .joints = joints};
}

Scene disturbed(Scene scene, std::uint32_t seed, double amount) {
  RandomNumbers numbers(seed);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    const Vector3 turn = amount * numbers.next_vector();
    body.pose.orientation = compose(body.pose.orientation, rotation_quaternion(turn));
    body.linear_velocity = amount * numbers.next_vector();
    body.angular_velocity = amount * numbers.next_vector();
  }
  return scene;
}

Formulated::Formulated(const Scene& scene, Joints joints, double hs)
    : model(build_model(scene)), finder(scene, model), state(initial_state(scene)) {
  problem.model = &model;
  problem.substeps.duration = hs;
  problem.substeps.offset.resize(state.v.size());
  if (model.contacts) problem.contacts = &finder.find(state, scene.step, 1);
  build_blocks(problem, joints);
  formulate(problem, state.q, hs);
}

std::vector<Velocity> Formulated::local_velocities() const {
  std::vector<Velocity> local = state.v;
  for (std::size_t i = 0; i < local.size(); ++i) {
    local[i].angular = state.q[i].angular.conjugate() * local[i].angular;
  }
  return local;
}

Row Formulated::in_world(const Block& x, int row) const {
  Row result = problem.c.rows[row];
  const auto turn = [&](int body, Vector3& angular, Vector3& response) {
    const Matrix3& rotation = problem.rotations[body];
    const Matrix3 inverse_inertia =
        rotation * model.masses[body].inverse_inertia.asDiagonal() * rotation.transpose();
    angular = (rotation * angular).eval();
    response = inverse_inertia * angular;
  };
  turn(x.a, result.angular_a, result.response_a);
  turn(x.b, result.angular_b, result.response_b);
  return result;
}

const Scene& Measurement::scene(const std::string& name) {
  const auto found = scenes_.find(name);
  if (found != scenes_.end()) return found->second;
  const bool is_tumbling = name == "tumbling rod_chain";
  return scenes_[name] = is_tumbling ? tumbling(scene("rod_chain")) : load_scene(folder_ / (name + ".gltf"));
}

const State& Measurement::reference(const std::string& name) {
  const auto found = references_.find(name);
  if (found != references_.end()) return found->second;
  // Smaller steps reduce no error of bodies that stand still.
  const bool stands = name == "stone_pyramid" || name == "card_house";
  return references_[name] = reference_run(scene(name), horizon, stands ? 4 : 128);
}

MeasuredRun Measurement::run(const std::string& name, Algorithm algorithm, int n, int m, Joints joints) {
  const Settings settings = settings_of(scene(name), algorithm, n, m, joints);
  if (algorithm > Algorithm::a2) return measured_run(scene(name), settings, horizon);
  // Pass the procedure, so that it takes a step as one.
  Simulation simulation(scene(name), settings, algorithm == Algorithm::a1 ? proc1 : proc2);
  return measured_run(simulation, horizon);
}

double Measurement::error(const std::string& name, Algorithm algorithm, int n, int m, Joints joints) {
  return error_of(run(name, algorithm, n, m, joints), reference(name));
}

}  // namespace substep::claims
