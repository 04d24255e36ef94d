#pragma once
/// The spectral radius of a sub-step, as a linear map of small velocities and joint gaps. Above 1 both grow
/// from sub-step to sub-step at every step size, and smaller sub-steps make it worse.
///
/// The coordinates are fixed and all joints are hard. Motion along the freedoms of joints is constant and
/// left out. A row's bias is what its opening over hs asks for, so that hs falls out. Between one row, whose
/// radius is known (stability_map.h), and rows that share bodies lie the sweep's order and m.

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

/// Returns the spectral radius for the settings of a run. Returns nothing for A1 and A2, for scenes with
/// other rows than those of hard joints, and above a hundred rows, since eigenvalues would take longer than
/// the run.
std::optional<double> substep_radius(const Scene& scene, const Settings& settings);

/// Above this, by more than rounding, what is open and what moves grows from sub-step to sub-step.
inline constexpr double growing_radius = 1 + 1e-6;

/// The scene with rods in place of springs: limits that were soft do not give.
Scene without_springs(Scene scene);

/// The scene at so many instants of its motion, the start included, `interval` s apart: by A1 at small steps.
/// All stand still.
std::vector<Scene> positions_of(const Scene& scene, int count, double interval);

/// A system of rows, at the positions that are looked at.
struct CoupledRows {
  std::string name;  ///< "chain of three rods"
  std::vector<Scene> positions;
};

/// With it none of them grows for τ up to 1 (claim 15).
inline constexpr double lower_kappa = 0.7;

inline constexpr std::string_view coupled_governor = "governor, rods";

/// One row, a block of three, chains, closed loops: of scenes in `folder`. Throws Error when one cannot be
/// read.
std::vector<CoupledRows> coupled_rows(const std::filesystem::path& folder);

/// The largest at any of the positions; joints in blocks.
double largest_radius(const CoupledRows& system, const Stabilization& by, int iterations);

}  // namespace substep
