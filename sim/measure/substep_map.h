#pragma once
/// The spectral radius of a sub-step, as a linear map of small velocities and joint gaps. Above 1 both grow
/// from sub-step to sub-step at every step size, and smaller sub-steps make it worse.
///
/// The coordinates are fixed and all joints are hard. Motion along the freedoms of joints is constant and
/// left out. A row's bias is its gap over the sub-step's length h_s, so that h_s cancels. Rows that share
/// bodies differ from one row, whose radius is known (stability_border()), by the sweep's order and m.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

/// Returns the spectral radius of a sub-step of A3 to A5 at the start of `scene`, which must have hard joints
/// and no contacts. Its velocities do not count. All three have equal maps, since the coordinates are fixed.
double substep_radius(const Scene& scene, const Stabilization& by, int iterations, Joints joints);

/// Returns the spectral radius for the settings of a run. Returns nothing for algorithms other than A3 to A5,
/// with a warm start, for scenes without joints or with other rows than those of hard joints, and above 20
/// joints, since the radius would take longer than the run.
std::optional<double> substep_radius(const Scene& scene, const Settings& settings);

/// Returns the scene with rods in place of springs: soft limits become hard.
Scene without_springs(Scene scene);

/// Returns `count` copies of the scene at rest, posed as at 0, `interval`, … s of A1 at small steps.
std::vector<Scene> positions_of(const Scene& scene, int count, double interval);

/// A system of rows, and the positions at which it is measured.
struct CoupledRows {
  std::string name;  ///< "chain of three rods"
  std::vector<Scene> positions;
};

/// κ with which no coupled system grows for τ up to 1 (claim 15).
inline constexpr double lower_kappa = 0.7;

inline constexpr std::string_view coupled_governor = "governor, rods";  ///< of coupled_rows()

/// Loads one row, a block of three, chains and closed loops from `folder`. Throws Error where it cannot.
std::vector<CoupledRows> coupled_rows(const std::filesystem::path& folder);

/// Returns the largest spectral radius over the positions, with joints in blocks.
double largest_radius(const CoupledRows& system, const Stabilization& by, int iterations);

}  // namespace substep
