#include "sim/measure/substep_map.h"

#include <algorithm>
#include <cmath>

#include "sim/constraints/formulate.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/measure/constrained_dynamics.h"
#include "sim/measure/invariants.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/model.h"
#include "sim/simulation.h"

namespace substep {
namespace {

constexpr double direction_tolerance = 1e-6;  // of rows' directions; positions are closed to 1e-9 or better

/// A scene's rows, and velocities as combinations of what their impulses can give.
class RowMap {
 public:
  RowMap(const Scene& scene, Joints joints) : model_(build_model(scene)), start_(initial_state(scene)) {
    if (!is_rigid(model_))
      throw Error("scene {}: a sub-step's map is of joints that do not give", scene.name);
    problem_.model = &model_;
    problem_.substeps.offset.resize(start_.v.size());
    build_blocks(problem_, joints);
    formulate(problem_, start_.q, 1);
    find_directions();
  }

  /// Returns the map of (velocities, gaps over h_s) in these directions.
  Eigen::MatrixXd map(const Stabilization& by, int iterations) {
    const Eigen::Index count = directions_.cols();
    Eigen::MatrixXd result(2 * count, 2 * count);
    for (Eigen::Index k = 0; k < 2 * count; ++k) {
      Eigen::VectorXd velocity = Eigen::VectorXd::Zero(count);
      Eigen::VectorXd opening = Eigen::VectorXd::Zero(count);
      (k < count ? velocity : opening)[k % count] = 1;
      set_velocities(opening);
      for (const Block& x : problem_.c.blocks) {
        for (int i = x.first; i < x.first + x.rows; ++i)
          problem_.c.rows[i].beta = -row_velocity(problem_.c.rows[i], v_[x.a], v_[x.b]);
      }
      set_velocities(velocity);
      clear_impulses(problem_.c);
      problem_.c.limits_of = 1;
      for (int i = 0; i < iterations; ++i) {
        for (const Block& x : problem_.c.blocks) apply(problem_.c, x, solve(problem_.c, x, by, v_), v_);
      }
      const Eigen::VectorXd after = directions_.transpose() * weighted_velocities();
      result.col(k) << after, opening + after;
    }
    return result;
  }

 private:
  void find_directions() {
    for (const BodyMass& mass : model_.masses)
      v_.push_back({Vector3::Constant(mass.root_inverse_mass), mass.root_inverse_inertia});
    roots_ = components(v_);
    set_zero(v_);
    Mlcp rows;
    Problem single = problem_;
    build_blocks(single, Joints::rows);
    formulate(single, start_.q, 1);
    make_mlcp(single, v_, rows);
    const auto factored = factored_directions(rows, direction_tolerance);
    directions_ = Eigen::MatrixXd(factored.matrixQ()).leftCols(factored.rank());
  }

  void set_velocities(const Eigen::VectorXd& parts) {
    components(v_) = roots_ * (directions_ * parts).array();
  }
  Eigen::VectorXd weighted_velocities() const { return (roots_ > 0).select(components(v_) / roots_, 0); }

  Model model_;
  State start_;
  Problem problem_;
  std::vector<Velocity> v_;
  Eigen::ArrayXd roots_;        // of M⁻¹, by component of v
  Eigen::MatrixXd directions_;  // of M^(1/2) v: an orthonormal basis of what impulses give
};

/// Returns the spectral radius of a map A: the limit of |A^p|^(1/p), by squaring A until p is 2^40.
double spectral_radius(Eigen::MatrixXd power) {
  constexpr int squarings = 40;
  double radius = 1;
  double exponent = 1;
  for (int i = 0; i <= squarings; ++i, exponent /= 2) {
    const double norm = power.norm();
    if (!(norm > 0)) return 0;
    radius *= std::pow(norm, exponent);
    power /= norm;
    power = power.lazyProduct(power).eval();  // small: a blocked product takes seconds to compile
  }
  return radius;
}

}  // namespace

double substep_radius(const Scene& scene, const Stabilization& by, int iterations, Joints joints) {
  return spectral_radius(RowMap(scene, joints).map(by, iterations));
}

std::optional<double> substep_radius(const Scene& scene, const Settings& settings) {
  constexpr std::size_t most_joints = 20;
  if (settings.algorithm < Algorithm::a3 || !is_of_report(settings.algorithm) || settings.warm_start > 0 ||
      scene.joints.empty() || scene.joints.size() > most_joints || !is_rigid(build_model(scene)))
    return std::nullopt;
  return substep_radius(scene, {settings.tau, settings.kappa}, settings.iterations, settings.joints);
}

Scene without_springs(Scene scene) {
  for (Joint& joint : scene.joints) {
    for (JointLimit& limit : joint.limits) {
      limit.stiffness.reset();
      limit.damping = 0;
    }
  }
  return scene;
}

std::vector<Scene> positions_of(const Scene& scene, int count, double interval) {
  constexpr int divisions = 512;
  Simulation simulation(scene, {.algorithm = Algorithm::a1, .step = interval / divisions});
  std::vector<Scene> positions;
  for (int k = 0; k < count; ++k) {
    for (int i = 0; k > 0 && i < divisions; ++i) simulation.step();
    Scene& position = positions.emplace_back(scene);
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      Body& body = position.bodies[i];
      body.pose = {simulation.state().q[i].linear, simulation.state().q[i].angular};
      body.linear_velocity = body.angular_velocity = Vector3::Zero();
    }
  }
  return positions;
}

std::vector<CoupledRows> coupled_rows(const std::filesystem::path& folder) {
  std::vector<CoupledRows> systems{{"one row", {weight_on_a_joint(0, {false, true, false})}},
                                   {"a block", {weight_on_a_joint(0, {true, true, true})}}};
  const auto add = [&](std::string name, const char* file) {
    const Scene scene = load_scene(folder / (std::string(file) + ".gltf"));
    systems.push_back({std::move(name), positions_of(without_springs(scene), 7, 0.1)});
  };
  for (const char* const name : {"rod_chain", "heavy_chain", "bricard", "four_bar"}) add(name, name);
  add(std::string(coupled_governor), "governor");
  return systems;
}

double largest_radius(const CoupledRows& system, const Stabilization& by, int iterations) {
  double largest = 0;
  for (const Scene& position : system.positions)
    largest = std::max(largest, substep_radius(position, by, iterations, Joints::plain));
  return largest;
}

}  // namespace substep
