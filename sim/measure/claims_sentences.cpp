#include "sim/measure/claims_sentences.h"

#include <algorithm>

namespace substep::claims {
namespace {

struct Sentence {
  int number;
  const char* section;
  const char* claim;
  const char* measured;  ///< 12's ends with numbers of its scene: claim12 adds them
};

constexpr Sentence sentences[]{
    {1, "IV.2.1", "One sub-step is one sweep: Γ̂(t,h,1) = Γ̂(t,h)",
     "A3 with n = m = 1 and single rows against A2 with one sweep, 1 s: largest difference in "
     "position (m) / orientation (rad)"},
    {2, "IV.2.2",
     "Sub-steps are as good as smaller steps where geometry does not change: Γ̂¹(t,h,n) = Γ̂¹(t,h/n)",
     "A3 with single rows against A2 with one sweep at h/n, 1 s: largest difference in position (m) / "
     "orientation (rad)"},
    {3, "IV.2.2", "At equal row solves, n sub-steps beat n iterations: Γ̂¹(t,h,n) is better than Γ̂ⁿ(t,h)",
     "error at 1 s of A3 (n sub-steps, m = 1) / A2 (one step, n sweeps) / A2 with the sweeps that take A3's "
     "time (3 to 8 n; fewer where it has converged, as on the pendulum); equal are h, the order of the rows, "
     "τ = κ = 1, joints by single rows, of the first two the row solves (each row n times a step, a "
     "contact's "
     "within its manifold), of the first and the third the time; contacts are found once a step in all"},
    {4, "IV.3", "A4 is a first-order approximation of A3",
     "tumbling rod_chain: one step, n = 4, plain blocks, h halved from 1/240 to 1/15360 s; slope of the "
     "difference in h, to be 2 in position and 1 in velocity"},
    {5, "IV.4", "A5 is A4 refactored: with frozen Jacobians they agree",
     "n = 4, m = 1 and 3, plain blocks: largest difference in position over τ/κ of 1/1, 0.6/0.9, "
     "0.3/1, 0.9/0.5, 1.2/1.1"},
    {6, "IV.4.1",
     "With recomputed Jacobians A5 falls below A4: its error has a floor where A4's goes on falling",
     "rod_chain, stable joints, m = 1: error at 1 s of A4 / A5"},
    {7, "IV.2.2, IV.3", "A3 costs about as much as A2 with n iterations; A4 and A5 less",
     "n = 4, single rows, 600 steps in turn; equal are the row solves, the time is what is measured: row "
     "solves a step of A2 / A3 / A4 / A5, and the ratio of "
     "median solver times (geometry, the step's first formulation and what contacts keep for the next step "
     "left out) to A2's of A3 / A4 / A5"},
    {8, "IV.3.1",
     "The bias update is exact for a body that does not rotate on a fixed plane, else of first order",
     "one sub-step: error of C by proc4:16 (m); else slope of that error in the angle turned, to be 2"},
    {9, "V.1, V.2", "Small rotations commute and add to first order",
     "200 pairs of rotation vectors, angles halved from 2⁻⁴ to 2⁻¹⁰ rad: slope of the largest "
     "error, to be 2"},
    {10, "III", "Local velocities change nothing: J v = J̆ v̆, and M̆⁻¹ does not change with time",
     "100 random poses and velocities up to 3 rad, 3 m/s, 3 rad/s: largest difference of row velocities "
     "(m/s, rad/s) / of responses R⁻¹M⁻¹Jᵀ and M̆⁻¹J̆ᵀ, relative"},
    {11, "IV.2.2", "τ, κ are not PSOR's ω: micro-iteration goes to J v = (τ/κ) β, PSOR to J v = β",
     "rod_chain out of place, without gravity, β = 0.25, τ = 0.5, κ = 0.8, 4000 sweeps: largest "
     "residual; stability of one row for τ, κ on a grid, A3 to A5, against the closed form"},
    {12, "IV.3.1.4", "A velocity-level row must undo the update rule",
     "powered_wheel, n = m = 4, plain blocks: speed of the motor"},
    {13, "IV.2.2", "Blocks help: 3×3 blocks beat single rows at equal cost",
     "A3, m = 1, 1 s; equal are the row solves, and nearly the time (below): error of blocks / rows, then "
     "largest joint gap of blocks / rows"},
    {14, "IV.3.2", "Frozen Jacobians hurt joints, next-frame ones mend it, at the cost of damping",
     "m = 1, 1 s: error (m) / largest joint gap (m) / change of energy (J)"},
    {15, "not the report's",
     "One row's limit, τ < 4 − 2κ, is not the system's: with κ = 1 coupled rows may grow below it, and "
     "smaller "
     "sub-steps then make it worse; a smaller κ ends it",
     "A3 in blocks, joints at rest: spectral radius of a sub-step's map, less 1, the largest of "
     "seven positions, with κ = 1 and τ = 1, m = 1 / τ = 0.6, m = 1 / τ = 0.3, m = 1 / τ = 1, m = 4, then "
     "with "
     "κ = 0.7 and τ = 1, m = 1 / τ = 1, m = 4; runs of 2 s with single rows, τ = 1, m = 1"},
    {16, "not the report's",
     "A3 with stable joints and τ = κ = 1 is small-step position-based dynamics without compliance (Macklin "
     "et al. 2019)",
     "one written from the papers beside A3, m = 1, 2 s: largest distance of a body's centre"},
    {17, "not the report's",
     "No τ and κ are best for all: what stands wants a large τ and a smaller κ, coupled rows a smaller κ, "
     "joints that carry much a large τ and κ = 1, and A5's rods gain energy with a large τ; so contacts have "
     "their own",
     "A5 at the default n, m, joints and the scene's step; with the default / with its τ and κ of joints "
     "for all rows / τ = κ = 1 / τ = 1, κ = 0.7 / its τ of joints, κ = 0.7"},
};

}  // namespace

Claim unmeasured_claim(int number) {
  const Sentence& of = *std::ranges::find(sentences, number, &Sentence::number);
  return {of.number, of.section, of.claim, of.measured, {}, {}};
}

}  // namespace substep::claims
