#pragma once
/// Augmented vertex block descent (AVBD) for rigid bodies. It is neither the report's nor a descendant of its
/// idea, but another new method for hard constraints.
///
/// Chris Giles, Elie Diaz, Cem Yuksel, "Augmented Vertex Block Descent", ACM Transactions on Graphics 44(4),
/// 2025. Written from the paper, with the parameters of its demos.

#include <cstdint>
#include <vector>

#include "sim/constraints/formulate.h"
#include "sim/descendants/carried_forces.h"
#include "sim/model/settings.h"

namespace substep {

/// One constraint of a step: C = value + J Δq, with Δq the bodies' displacement since the step began.
struct AvbdRow {
  Vector3 linear;     ///< J of body a; that of b is −linear
  Vector3 angular_a;  ///< in the bodies' frames
  Vector3 angular_b;
  double value;      ///< of C when the step begins, less the part of it that the step keeps; m or rad
  double force;      ///< λ: the force on a along J, N or N·m; the paper's has the opposite sign
  double penalty;    ///< k, N/m or N·m/rad
  double stiffness;  ///< of the material; infinite for what is rigid
  double growth;     ///< β, of the penalty by |C|
  double low;        ///< limits of the force
  double high;
};

/// A joint's block, or a contact point with its normal and two tangents.
struct AvbdBlock {
  int a;
  int b;
  int first;  ///< rows[first] …
  int rows;
  int joint;        ///< of Constraints::blocks; −1: a contact
  double friction;  ///< μ of a contact
};

/// Buffers that outlive a step, and the step's report.
struct AvbdWork {
  std::vector<AvbdRow> rows;
  std::vector<AvbdBlock> blocks;
  std::vector<int> begins;             ///< by body: of its blocks in `blocks_of`
  std::vector<int> blocks_of;          ///< indices of `blocks`
  std::vector<Coordinates> inertial;   ///< where the bodies would be without constraints
  std::vector<Velocity> displacement;  ///< since the step began: m, and the rotation vector, body frame
  std::vector<std::uint8_t> sticks;    ///< by block: whether friction holds it
  std::int64_t row_solves = 0;
};

/// Makes a step of settings.iterations iterations: steps `q` and `v_local`, whose angular velocities are in
/// the bodies' frames. `problem` holds the joints' blocks and the contacts that were found. `start` has the
/// forces and penalties of joints' rows when the step begins (State::joint_forces), `carried` those when it
/// ends.
void avbd(std::vector<Coordinates>& q, std::vector<Velocity>& v_local, const Settings& settings,
          Problem& problem, const std::vector<double>& start, AvbdWork& work, CarriedForces& carried);

}  // namespace substep
