#pragma once
/// The runs that a film shows side by side, and how far each is from the reference.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/video/panel.h"
#include "sim/measure/metrics.h"
#include "sim/measure/reference_cache.h"
#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// What is read of runs at each film frame, beside the poses.
struct ReadingChoice {
  bool gap = false;
  bool energy = false;
  bool speeds = false;
  bool depths = false;
  bool contacts = false;
  bool deepest = false;
  const Expectation* expected = nullptr;  ///< of the scene's, see expectation_of_poses()
};

/// The quantity that a strip below a panel's picture shows over time.
enum class Strip { error, gap, energy, depth, expected };

struct ComparisonSettings {
  std::vector<PanelChoice> panels;
  double step = 1.0 / 60;            ///< s, that the reference's steps are parts of
  double start = 0;                  ///< s, of the film's first frame
  double duration = 5;               ///< s, of its last frame
  double frame_interval = 1.0 / 30;  ///< s of the scene's time from one frame to the next
  bool has_reference = true;         ///< whether errors are measured
  int reference_substeps = 16;       ///< the reference's step is step / this, where that many are needed
  ReadingChoice readings;
  int threads = 2;
  ReferenceCache cache;  ///< of the reference's two runs; the scene must be as its files have it
};

/// As ReadingChoice asks for them; each has one entry for each film frame that has poses, or none.
struct Readings {
  std::vector<double> gaps;      ///< of joints, see JointGapMeter, m
  std::vector<double> energies;  ///< kinetic and potential, since the film's first frame, J; not of logs
  std::vector<double> deepest;   ///< how far a body is in another at most, m
  std::vector<double> expected;  ///< the quantity that ReadingChoice::expected is about, in its unit
  std::vector<std::vector<float>> speeds;             ///< of each body's centre, m/s
  std::vector<std::vector<float>> depths;             ///< of each body, how far it is in another, m
  std::vector<std::vector<ContactImpulse>> contacts;  ///< of the frame's last step; of algorithms only
};

/// One panel's run.
struct Run {
  PanelChoice panel;
  std::vector<std::vector<Coordinates>> poses;  ///< of each film frame; fewer when it diverged
  /// Of each film frame that the reference is known at too: RMS distance of the bodies' points from where the
  /// reference has them, over each body's mass and then over the dynamic bodies, m. It sees turns too.
  std::vector<double> errors;
  double rms_error = 0;  ///< over `errors`, m
  Readings readings;
  std::int64_t row_solves = 0;
  double cpu_time = 0;                ///< of its steps, s; differs from time to time; not of logs
  double simulated = 0;               ///< by these steps, s
  std::optional<double> diverged;     ///< when, s
  std::string refusal;                ///< why an engine cannot do the scene; then of poses the start alone
  int unsolved = 0;                   ///< steps that A1 did not solve to the accuracy asked for
  std::vector<Violation> violations;  ///< of algorithms, as far as the film goes

  bool is_reference() const { return panel.kind == PanelChoice::Kind::reference; }
};

/// A film's reference: where the scene's forces are smooth, the reference DAE integrator; else, or
/// where that ends before the film, A1 at small steps. Each is run once more at twice the step. Where A1 at
/// an eighth and at a fourth of the sub-steps agree within 1e-9 of the scene's size in every frame, these two
/// are the reference.
struct ReferenceRun {
  std::string method;                           ///< "own, order 8, h=1/240", "A1, h=1/960"
  std::vector<std::vector<Coordinates>> poses;  ///< of each film frame that it reached
  std::vector<double> uncertainty;              ///< how far the two runs are apart, m, measured as errors are
  std::size_t known = 0;                        ///< errors are measured at frames before this
  std::string fate;                             ///< why not at all of them; empty: they are
  bool is_a1 = false;                           ///< not the integrator: A1's errors are from itself then
};

struct Comparison {
  std::vector<Run> runs;      ///< the panels, in their order
  std::vector<double> times;  ///< of each film frame, s; poses between two steps are interpolated
  std::optional<ReferenceRun> reference;
  std::optional<Strip> strip;  ///< what strips show unless told otherwise; none without a reference
  const Expectation* expected = nullptr;  ///< what Strip::expected shows
};

/// Where a run is first away from the reference.
struct Departure {
  std::size_t frame = 0;
  int body = world_body;  ///< that is away farthest then
  double distance = 0;    ///< m, as errors are measured
};
/// A body is away at this part of the scene's size.
inline constexpr double away = 0.02;
/// Nothing where it is never away, or the reference is not known before.
std::optional<Departure> departure_of(const Scene& scene, const Comparison& comparison, const Run& run);

/// The part of the scene's size by which the reference's two runs may differ: after that they have parted.
inline constexpr double parted = 0.01;

/// Mean over the body's mass of the squared distance between where a point is and where it should be, m².
double squared_distance(const Body& body, const Coordinates& is, const Coordinates& should_be);

/// Fills the run's errors, where it has poses and the reference is known.
void measure_from(const Scene& scene, const ReferenceRun& reference, Run& run);

/// Runs all panels. `progress` gets the share done, on the calling thread; may be empty.
/// Throws Error when the settings cannot be used, a log is of another scene, or the scene cannot be modelled.
Comparison simulate_comparison(const Scene& scene, const ComparisonSettings& settings,
                               const std::function<void(double)>& progress = {});

}  // namespace substep::render
