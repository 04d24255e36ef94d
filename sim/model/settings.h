#pragma once
/// The settings of solving: everything about a run that is not in the scene.

#include <optional>
#include <string>
#include <string_view>

namespace substep {

/// The five procedures of the report, each in a file of its own; see algorithms.h. Two further methods, Soft
/// Step and AVBD, are not the report's; see the folder `descendants`.
enum class Algorithm { a1, a2, a3, a4, a5, soft, avbd };

/// Returns true where the algorithm is one of the report's five.
constexpr bool is_of_report(Algorithm algorithm) {
  return algorithm <= Algorithm::a5;
}

/// The treatment of joints' rows.
enum class Joints {
  rows,    ///< each row alone, as A2 does
  plain,   ///< up to three rows at once (IV.2.2, point 2), Jacobian of the sub-step's start
  stable,  ///< the same, Jacobian at next-frame coordinates (IV.2.2, point 2; IV.3.2, third item): ball
           ///< joints, the parts of hinges, sliders and fixed joints, and the stiff spring
};

/// Factors of a row, in J(κ v + M⁻¹Jᵀλ) = τ β.
struct Stabilization {
  double tau = 1;    ///< τ
  double kappa = 1;  ///< κ
};

struct Settings {
  Algorithm algorithm = Algorithm::a3;
  double step = 1.0 / 60;         ///< h, seconds
  int substeps = 4;               ///< n; A1 and A2 have none
  int iterations = 1;             ///< m; for A2 the iteration cap ap; A1 has none
  double tau = 1;                 ///< τ; A3–A5
  double kappa = 1;               ///< κ; A3–A5
  double contact_tau = 0;         ///< τ of contacts alone, where the report has one for all rows; 0: τ
  double contact_kappa = 0;       ///< κ of contacts alone; 0: κ
  Joints joints = Joints::plain;  ///< A3–A5
  double relaxation = 1;          ///< ω of A2's successive over-relaxation
  double tolerance = 0;  ///< aw of A2: it ends when no row moves its velocity by more, m/s or rad/s; 0: never
  double warm_start = 0;  ///< A2–A5: the fraction of the last (sub-)step's λ that the next one starts from
  double contact_hertz = 30;  ///< Soft Step: frequency of contacts, Hz; at most 1/8 of the sub-steps' rate
  double joint_hertz = 60;    ///< Soft Step: frequency of joints, Hz; at most 1/4 of the sub-steps' rate
  double alpha = 0.99;        ///< AVBD: α, the fraction of a position error that a step leaves
  double beta = 1e4;  ///< AVBD: β, growth of the penalty by the error, N/m²; of angular rows a hundredth

  /// The settings of A3, A4 and A5: n, m, τ, κ.
  struct Substepping {
    int n;
    int m;
    double tau;
    double kappa;
  };
  Substepping substepping() const { return {substeps, iterations, tau, kappa}; }

  Stabilization of_contacts() const {
    return {contact_tau == 0 ? tau : contact_tau, contact_kappa == 0 ? kappa : contact_kappa};
  }
};

/// Returns the defaults of an algorithm for all scenes; for a scene's n see usual_settings.h. They are n = 10
/// and m = 1 (A2: ten iterations, as many row solves), τ = 0.6 and κ = 1, τ = 0.9 and κ = 0.7 of contacts
/// (claim 17), and 'stable' joints. Settings{} is the report's plainest, with τ = κ = 1. Soft Step and AVBD
/// have their published defaults: n = 4, and ten iterations.
Settings default_settings(Algorithm algorithm);

/// Returns the settings with n times the least work a step: n sub-steps of A3 to A5 and of Soft Step, n
/// iterations of AVBD; A1 and A2 take the step in n parts.
Settings divided(Settings settings, int n);

/// Returns h, or h/n of A3 to A5 and of Soft Step, s.
double sub_step_of(const Settings& settings);

std::string_view name(Algorithm algorithm);      ///< "a3", as it is typed
std::string_view title_of(Algorithm algorithm);  ///< "A3", as people read it
std::string_view name(Joints joints);
std::optional<Algorithm> algorithm_named(std::string_view name);
std::optional<Joints> joints_named(std::string_view name);

/// Throws Error naming the first setting that cannot be used (a step that is not positive, κ = 0, …).
void check(const Settings& settings);

/// Returns the algorithm and the settings that it reads: n, m, joints and h always, others where they differ
/// from Settings{}: "A3  n=4 m=1 plain  h=1/60". Contacts' own τ and κ follow a slash: "τ=0.6/0.9 κ=1/0.7".
std::string label(const Settings& settings);

/// Return τ and κ with six digits; the contacts' own follow a slash: "0.6/0.9".
std::string tau_text(const Settings& settings);
std::string kappa_text(const Settings& settings);

}  // namespace substep
