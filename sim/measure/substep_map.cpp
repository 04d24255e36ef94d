#include "sim/measure/substep_map.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "sim/constraints/formulate.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/measure/weight_scene.h"
#include "sim/model/model.h"
#include "sim/simulation.h"

namespace substep {
namespace {

constexpr double rank_tolerance = 1e-6;  // of rows' directions; positions are closed to 1e-9 or better

/// True where all rows belong to hard joints.
bool is_rigid(const Model& model) {
  return !model.contacts && model.drives.empty() &&
         std::ranges::none_of(
             model.limits, [](const Limit& limit) { return limit.soft || limit.side != Limit::Side::both; });
}

/// A scene's rows, and velocities as combinations of what their impulses can give.
class RowMap {
 public:
  RowMap(const Scene& scene, Joints joints) : model_(build_model(scene)), start_(initial_state(scene)) {
    if (!is_rigid(model_)) {
      throw Error(fmt::format("scene {}: a sub-step's map is of joints that do not give", scene.name));
    }
    problem_.model = &model_;
    problem_.contacts = &no_contacts_;
    problem_.substeps.offset.resize(start_.v.size());
    build_blocks(problem_, joints);
    formulate(problem_, start_.q, 1);
    find_directions();
  }

  /// Returns the map of (velocities, gaps over hs) in these directions.
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
    v_.resize(start_.v.size());
    std::ranges::fill(v_, Velocity{Vector3::Zero(), Vector3::Zero()});
    Mlcp rows;
    Problem single = problem_;
    build_blocks(single, Joints::rows);
    formulate(single, start_.q, 1);
    make_mlcp(single, v_, rows);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6) * rows.bodies,
                                                    static_cast<Eigen::Index>(rows.rows.size()));
    for (Eigen::Index i = 0; i < columns.cols(); ++i) {
      const Mlcp::Row& row = rows.rows[i];
      if (row.a >= 0) columns.col(i).segment<6>(6 * row.a) += row.part_a;
      if (row.b >= 0) columns.col(i).segment<6>(6 * row.b) += row.part_b;
      columns.col(i).normalize();
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factored(columns);
    factored.setThreshold(rank_tolerance);
    directions_ = Eigen::MatrixXd(factored.householderQ()).leftCols(factored.rank());
  }

  void set_velocities(const Eigen::VectorXd& parts) {
    const Eigen::VectorXd weighted = directions_ * parts;
    for (std::size_t i = 0; i < v_.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(6 * i);
      v_[i].linear = model_.masses[i].root_inverse_mass * weighted.segment<3>(at);
      v_[i].angular = model_.masses[i].root_inverse_inertia.cwiseProduct(weighted.segment<3>(at + 3));
    }
  }
  Eigen::VectorXd weighted_velocities() const {
    const auto over = [](double value, double root) { return root > 0 ? value / root : 0; };
    Eigen::VectorXd weighted(static_cast<Eigen::Index>(6 * v_.size()));
    for (std::size_t i = 0; i < v_.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<Eigen::Index>(6 * i) + k;
        weighted[at] = over(v_[i].linear[k], model_.masses[i].root_inverse_mass);
        weighted[at + 3] = over(v_[i].angular[k], model_.masses[i].root_inverse_inertia[k]);
      }
    }
    return weighted;
  }

  Model model_;
  State start_;
  std::vector<Contact> no_contacts_;
  Problem problem_;
  std::vector<Velocity> v_;
  Eigen::MatrixXd directions_;  // of M^(1/2) v: an orthonormal basis of what impulses give
};

CoupledRows system(std::string name, const Scene& scene, int positions, double interval) {
  return {std::move(name), positions_of(scene, positions, interval)};
}

}  // namespace

double substep_radius(const Scene& scene, const Stabilization& by, int iterations, Joints joints) {
  return RowMap(scene, joints).map(by, iterations).eigenvalues().cwiseAbs().maxCoeff();
}

std::optional<double> substep_radius(const Scene& scene, const Settings& settings) {
  constexpr std::size_t most_joints = 20;  // of up to five rows
  if (settings.algorithm < Algorithm::a3 || scene.joints.empty() || scene.joints.size() > most_joints ||
      !is_rigid(build_model(scene))) {
    return std::nullopt;
  }
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
  Settings settings;
  settings.algorithm = Algorithm::a1;
  constexpr int divisions = 512;
  settings.step = interval / divisions;
  Simulation simulation(scene, settings);
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
  const auto scene = [&](const char* name) { return load_scene(folder / (std::string(name) + ".gltf")); };
  JointLimit locked;
  locked.axes = {false, true, false};
  locked.min = locked.max = 0;
  const Scene row = weight_on_a_joint(0, locked);
  locked.axes = {true, true, true};
  const Scene block = weight_on_a_joint(0, locked);
  return {system("one row", row, 1, 1),
          system("a block", block, 1, 1),
          system("rod_chain", scene("rod_chain"), 7, 0.1),
          system("heavy_chain", scene("heavy_chain"), 7, 0.1),
          system("bricard", scene("bricard"), 7, 0.1),
          system("four_bar", scene("four_bar"), 7, 0.1),
          system(std::string(coupled_governor), without_springs(scene("governor")), 7, 0.1)};
}

double largest_radius(const CoupledRows& system, const Stabilization& by, int iterations) {
  double largest = 0;
  for (const Scene& position : system.positions)
    largest = std::max(largest, substep_radius(position, by, iterations, Joints::plain));
  return largest;
}

}  // namespace substep
