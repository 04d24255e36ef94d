#include "sim/measure/claims_measurement.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>

#include "sim/algorithms.h"
#include "sim/loading/load_scene.h"
#include "sim/math/rotation.h"

namespace substep::claims {
namespace {

/// Every body moving in a way of its own, in space; joints that were closed stay closed.
Scene tumbling(Scene scene) {
  Scene turned = disturbed(scene, 7, 1);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) turned.bodies[i].pose = scene.bodies[i].pose;
  // A1 at small steps takes away what the joints do not let pass, and leads out of the plane.
  Settings fine;
  fine.algorithm = Algorithm::a1;
  fine.step = 1.0 / 61440;
  const State state = measured_run(turned, fine, 0.2).state;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    scene.bodies[i].pose = {state.q[i].linear, state.q[i].angular};
    scene.bodies[i].linear_velocity = state.v[i].linear;
    scene.bodies[i].angular_velocity = state.v[i].angular;
  }
  return scene;
}

}  // namespace

Settings settings_of(const Scene& scene, Algorithm algorithm, int n, int m, Joints joints) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.step = scene.step;
  settings.substeps = n;
  settings.iterations = m;
  settings.joints = joints;
  return settings;
}

MeasuredRun undivided_run(const Scene& scene, const Settings& settings, double duration) {
  if (settings.algorithm > Algorithm::a2) return measured_run(scene, settings, duration);
  // A given procedure takes a step as one.
  Simulation simulation(scene, settings, settings.algorithm == Algorithm::a1 ? proc1 : proc2);
  return measured_run(simulation, duration);
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
  problem.contacts = &no_contacts;
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
  Row result = problem.c.rows[static_cast<std::size_t>(row)];
  const auto turn = [&](int body, Vector3& angular, Vector3& response) {
    const auto i = static_cast<std::size_t>(body);
    const Matrix3& rotation = problem.rotations[i];
    const Matrix3 inverse_inertia =
        rotation * model.masses[i].inverse_inertia.asDiagonal() * rotation.transpose();
    angular = (rotation * angular).eval();
    response = inverse_inertia * angular;
  };
  turn(x.a, result.angular_a, result.response_a);
  turn(x.b, result.angular_b, result.response_b);
  return result;
}

Measurement::Measurement(const std::filesystem::path& folder) : folder_(folder) {
  for (const char* name : {"rod_chain", "heavy_chain", "pendulum", "incline", "powered_wheel", "box_stack",
                           "tumbling_body", "stone_pyramid", "card_house"}) {
    scenes_[name] = load_scene(folder / (std::string(name) + ".gltf"));
  }
  scenes_["tumbling rod_chain"] = tumbling(scenes_["rod_chain"]);
}

const Reference& Measurement::reference(const std::string& name) {
  const auto found = references_.find(name);
  if (found != references_.end()) return found->second;
  // Bodies that stand still have no error that smaller steps reduce.
  const bool stands = name == "stone_pyramid" || name == "card_house";
  return references_[name] = reference_run(scene(name), horizon, stands ? 4 : 128);
}

MeasuredRun Measurement::run(const std::string& name, Algorithm algorithm, int n, int m,
                             Joints joints) const {
  return undivided_run(scene(name), settings_of(scene(name), algorithm, n, m, joints), horizon);
}

double Measurement::error(const std::string& name, Algorithm algorithm, int n, int m, Joints joints) {
  return error_of(run(name, algorithm, n, m, joints), reference(name));
}

std::vector<std::vector<double>> solver_times(const Scene& scene, const std::vector<Settings>& all,
                                              const std::vector<Procedure>& procedures, int steps) {
  std::vector<std::vector<double>> times(all.size());
  std::vector<Simulation> simulations;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto timed = [&times, k, procedure = procedures[k]](CoordinateVector& q, VelocityVector& v,
                                                              const Settings& settings, Problem& problem,
                                                              Work& work) {
      using Clock = std::chrono::steady_clock;
      const Clock::time_point start = Clock::now();
      procedure(q, v, settings, problem, work);
      times[k].push_back(std::chrono::duration<double>(Clock::now() - start).count());
    };
    simulations.emplace_back(scene, all[k], timed);
  }
  for (int i = 0; i < steps; ++i) {
    for (Simulation& simulation : simulations) simulation.step();
  }
  return times;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace substep::claims
