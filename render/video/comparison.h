#pragma once
/// The runs that a film shows side by side, and their distances from the reference.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/video/panel.h"
#include "sim/measure/metrics.h"
#include "sim/measure/reference_cache.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// The quantity that a strip below a panel's picture shows over time.
enum class Strip { error, gap, energy, depth, expected };

/// The choice of quantities that are measured in runs at each film frame, beside the poses.
struct QuantityChoice {
  bool gap = false;
  bool energy = false;
  bool speeds = false;
  bool depths = false;  ///< penetration of each body
  bool contacts = false;
  bool deepest = false;                   ///< deepest penetration of a body
  const Expectation* expected = nullptr;  ///< one of the scene's, see expectation_of_poses()

  /// Adds the quantity of a strip. Throws Error where the scene does not have it.
  void add(Strip strip, const Scene& scene);
};

struct ComparisonSettings {
  std::vector<PanelChoice> panels;
  double step = 1.0 / 60;            ///< s, a multiple of the reference's step
  double start = 0;                  ///< s, of the film's first frame
  double duration = 5;               ///< s, of the film's last frame
  double frame_interval = 1.0 / 30;  ///< s of the scene's time between frames
  bool has_reference = true;         ///< true: simulate a reference and measure errors
  int reference_substeps = 16;       ///< largest number of reference steps in one `step`
  QuantityChoice quantities;
  int threads = 2;
  ReferenceCache cache;  ///< of the reference's two runs; valid for a scene that equals its files
};

/// The quantities of a QuantityChoice, by film frame that has poses.
struct FrameQuantities {
  std::vector<double> gaps;      ///< largest gap of a joint, see JointGapMeter, m
  std::vector<double> energies;  ///< kinetic and potential, since the run's start, J; not of pose logs
  std::vector<double> deepest;   ///< deepest penetration of a body, m
  std::vector<double> expected;  ///< the quantity of QuantityChoice::expected, in its unit
  std::vector<std::vector<float>> speeds;             ///< of each body's centre, m/s
  std::vector<std::vector<float>> depths;             ///< penetration of each body, m
  std::vector<std::vector<ContactImpulse>> contacts;  ///< of the frame's last step; of algorithms only
};

/// One panel's run.
struct Run {
  PanelChoice panel;
  std::vector<std::vector<Coordinates>> poses;  ///< of each film frame; fewer when it diverged
  /// RMS distance of the bodies' points from their positions in the reference, over each body's mass and then
  /// over the dynamic bodies, m, of each film frame at which the reference is known.
  std::vector<double> errors;
  double rms_error = 0;  ///< over `errors`, m
  FrameQuantities quantities;
  std::int64_t row_solves = 0;
  double cpu_time = 0;                ///< of the steps, s; varies; not of logs
  double simulated = 0;               ///< time that these steps simulate, s
  std::optional<double> diverged;     ///< time of divergence, s
  std::string refusal;                ///< why an engine cannot simulate the scene; the start is its only pose
  int unsolved = 0;                   ///< steps that A1 did not solve to the accuracy asked for
  std::vector<Violation> violations;  ///< of algorithms, until the film's end

  bool is_reference() const { return panel.kind == PanelChoice::Kind::reference; }
};

/// A film's reference: where the scene's forces are smooth, the reference DAE integrator; else, or where that
/// ends before the film, A1 at small steps. A second run at twice the step gives the uncertainty. Where A1 at
/// an eighth and at a fourth of the sub-steps agree within 1e-9 of the scene's size in every frame, these two
/// runs are the reference.
struct ReferenceRun {
  std::string method;                           ///< "own, order 8, h=1/240", "A1 itself, h=1/960"
  std::vector<std::vector<Coordinates>> poses;  ///< of each film frame that the reference reached
  std::vector<double> uncertainty;              ///< distance of the two runs, m, measured as errors are
  std::size_t known = 0;                        ///< number of frames at which errors are measured
  std::string fate;                             ///< reason of the early end; empty: all frames are known
  bool is_a1 = false;                           ///< A1 is the reference, also of its own errors
};

struct Comparison {
  std::vector<Run> runs;      ///< the panels, in their order
  std::vector<double> times;  ///< of each film frame, s; poses between two steps are interpolated
  std::optional<ReferenceRun> reference;
  std::optional<Strip> strip;             ///< the quantity of strips by default; none without a reference
  const Expectation* expected = nullptr;  ///< the quantity of Strip::expected
};

/// A run's first divergence from the reference.
struct Divergence {
  std::size_t frame = 0;
  int body = world_body;  ///< the farthest body in this frame
  double distance = 0;    ///< of this body, m, as errors are measured
};
/// Returns nothing where no body is farther from the reference than 2 % of the scene's size while the
/// reference is known.
std::optional<Divergence> divergence_of(const Scene& scene, const Comparison& comparison, const Run& run);

/// Returns the mean over the body's mass of the squared distance between a point's two positions, m².
double squared_distance(const Body& body, const Coordinates& is, const Coordinates& should_be);

/// Measures the run's errors, where it has poses and the reference is known.
void measure_from(const Scene& scene, const ReferenceRun& reference, Run& run);

/// Simulates all panels. `progress` receives the fraction done, on the calling thread; may be empty.
/// Throws Error when the settings cannot be used, a log is of another scene, or the scene cannot be modelled.
Comparison simulate_comparison(const Scene& scene, const ComparisonSettings& settings,
                               const std::function<void(double)>& progress = {});

}  // namespace substep::render
