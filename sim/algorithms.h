#pragma once
/// The five algorithms of the report, one file each, in the order and words of its listings.
///
/// | file               | listing | differs from the one before by                                           |
/// |--------------------|---------|--------------------------------------------------------------------------|
/// | a1_direct.cpp      | proc1   | solves all rows at once, to rounding                                     |
/// | a2_psor.cpp        | proc2   | solves row by row, iterating                                             |
/// | a3_substep.cpp     | proc3   | n sub-steps, local angular velocities, blocks, τ and κ                   |
/// | a4_approximate.cpp | proc4   | approximates J̆ (line 15), β (line 16) and the orientation step (line 20) |
/// | a5_havok.cpp       | proc5   | A4 refactored; all Jacobians in β identified with the current one        |
///
/// Each function steps `q` and `v` in place. `problem` holds 𝒞 with J¹, β¹ formulated at q (steps s1 and s2).
/// In A1 and A2 `v` is in the world frame; in A3, A4 and A5 in the bodies' frames (v̆). The rows always are
/// in the bodies' frames (J̆). Cost, in row solves: A2 m, A3–A5 n·m per row; A3 formulates n times, the others
/// once.

#include <cstdint>
#include <vector>

#include "sim/constraints/formulate.h"
#include "sim/descendants/descendants.h"
#include "sim/direct/direct_solver.h"
#include "sim/direct/mlcp.h"
#include "sim/model/settings.h"

namespace substep {

using CoordinateVector = std::vector<Coordinates>;
using VelocityVector = std::vector<Velocity>;

/// Buffers that outlive a step, and the step's report.
struct Work {
  VelocityVector sum;           ///< A3, A4: Σ v̆ᵏ
  VelocityVector sum_v;         ///< A5: sv
  Mlcp mlcp;                    ///< A1
  DirectSolver solver;          ///< A1
  std::vector<double> lambda;   ///< A1
  MlcpReport report;            ///< A1
  std::vector<SoftPoint> soft;  ///< Soft Step
  AvbdWork avbd;                ///< AVBD
  CarriedForces carried;        ///< Soft Step, AVBD
  std::int64_t row_solves = 0;
};

void proc1(CoordinateVector& q, VelocityVector& v, const Settings& settings, Problem& problem, Work& work);
void proc2(CoordinateVector& q, VelocityVector& v, const Settings& settings, Problem& problem, Work& work);
void proc3(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
           Work& work);
void proc4(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
           Work& work);
void proc5(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
           Work& work);

}  // namespace substep
