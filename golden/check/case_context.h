#pragma once
/// Internals of check(): the plan, the output folder, the checker of one case, and the context that the steps
/// of a case pass on.

#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "golden/check/check.h"
#include "golden/compare/provenance.h"
#include "golden/compare/track.h"
#include "golden/suite/sidecar.h"
#include "render/renderer.h"
#include "sim/error.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// The cases of a check.
struct CheckPlan {
  Suite suite;
  CheckOptions options;
  std::vector<SuiteCase> cases;
};

/// The folder that a check writes to. Results are written as cases end, and marked incomplete until the check
/// ends. No two checks write at once.
class CheckOutput {
 public:
  /// Makes the folder. Throws Error when another check writes there.
  explicit CheckOutput(std::filesystem::path folder);
  ~CheckOutput();
  CheckOutput(const CheckOutput&) = delete;
  CheckOutput& operator=(const CheckOutput&) = delete;

  /// Replaces the results of an earlier check.
  void start(const CheckPlan& plan);
  void set_made_with(const Json& made_with) { results_["made_with"] = made_with; }
  void add_case(const Json& entry);

  /// Marks the results complete, and writes them and the report.
  void finish(const std::vector<std::filesystem::path>& orphans);

 private:
  using Clock = std::chrono::steady_clock;

  void write();

  std::filesystem::path folder_;
  int lock_ = -1;
  Json results_;
  Clock::time_point last_written_;
};

/// Reads the suite, calls `run`, and writes results and report. Throws Error.
void check_with(const CheckOptions& options, const std::function<void(const CheckPlan&, CheckOutput&)>& run);

/// Checks cases one after another. Those of one scene follow each other, so that it is loaded once.
class CaseChecker {
 public:
  /// Starts the renderer only where a case has pictures.
  explicit CaseChecker(const CheckPlan& plan);

  /// Checks a case, and prepares its approval. Errors in the case become its verdict.
  CaseResult check(const SuiteCase& entry);

  const MadeWith& made_with() const { return made_with_; }

 private:
  std::filesystem::path output_;
  MadeWith made_with_;
  std::filesystem::path scene_file_;
  std::optional<Scene> scene_;
};

/// Returns the result of a case that could not be checked.
CaseResult failed_case(const std::filesystem::path& output, const SuiteCase& entry, const std::string& why);

/// Returns a case's part of results.json.
Json to_json(const CaseResult& result);

/// A picture with its image of bodies. Both are empty where there was nothing to draw.
struct Drawing {
  render::Image picture;
  render::Image bodies;

  bool is_there() const { return !picture.rgb.empty(); }
};

/// Draws a case's frames, of one pose log, as the golden pictures are drawn.
///
/// A painter serves one run, whose poses set the ground and, where the scene has none, the camera.
class CasePainter {
 public:
  CasePainter(const Scene& scene, const SuiteCase& entry, const PoseLog& log);

  Drawing draw(std::span<const Coordinates> poses) {
    return {renderer_.draw(poses), renderer_.draw_bodies(poses)};
  }

 private:
  render::Renderer renderer_;
};

/// Returns the poses of the frames in which the log has all bodies of the scene.
std::vector<std::vector<Coordinates>> full_frames(const PoseLog& log, const Scene& scene);

/// A case while it is checked.
struct CaseContext {
  LoggedMotion golden_motion() const { return {&*golden, golden_track ? &*golden_track : nullptr}; }
  LoggedMotion live_motion() const { return {&*live, &*live_track}; }

  void note(std::string text) { result.notes.push_back(std::move(text)); }

  /// Writes a file of the case's folder, which is made where it is not there. Returns the file.
  std::filesystem::path write(const std::string& name, std::string_view bytes) const;
  void write(const std::string& name, const render::Image& picture) const {
    write(name, render::to_png(picture));
  }

  /// Returns true where pictures must be equal: on the pinned renderer; for a case with `any_renderer`, on
  /// the platform that drew its goldens.
  bool is_exact_here() const {
    return result.entry.any_renderer ? sidecar.platform == made_with.platform : made_with.is_pinned;
  }

  const MadeWith& made_with;
  const Scene& scene;
  CaseResult result = {};
  Sidecar sidecar = {};
  std::optional<PoseLog> golden = {};
  std::optional<Track> golden_track = {};
  std::optional<PoseLog> live = {};
  std::optional<Track> live_track = {};
  std::vector<std::string> edited = {};  ///< golden files that differ from the approved ones
  std::vector<Drawing> drawn = {};       ///< drawings of the golden poses, one for each picture
  std::vector<Drawing> new_images = {};  ///< drawings of the live poses; empty where not needed
};

/// Returns true where pictures are within the tolerance: by FLIP where it is set, else by levels and counts.
bool is_within(const PictureComparison& comparison, const ImageTolerance& tolerance);

/// Calls `read`, which reads goldens, and adds the remedy to its Error.
template <typename Read>
auto read_goldens(Read&& read) {
  try {
    return read();
  } catch (const Error& error) {
    throw Error("{}: put back the golden that was approved, or delete it, then check and approve again",
                error.what());
  }
}

/// Draws the golden poses and compares with the golden pictures, which shows what the renderer changed, and
/// with pictures of the live poses, which shows what the simulation changed. Writes the pictures that differ.
void check_images(CaseContext& context);

/// Sets verdict and cause. The first rule that applies decides:
///
///  1. new, missing      no golden exists; a golden, the sidecar or the track is absent;
///  2. golden edited     all failures are against goldens that differ from their hash in the sidecar, so that
///                       nobody approved them;
///  3. scene changed     the scene's file is not the one that the goldens were made of, and its changes bear
///                       on what fails (motion, pictures or both);
///  4. loading changed   an equal file loads with other masses, positions, shapes or meshes;
///  5. simulation, renderer or both changed: all other cases. Environment: only pictures fail, and not
///                       is_exact_here().
void decide(CaseContext& context);

/// Returns the explanation of a failing case for a person, without the commands (failures.h).
std::string explain(const CaseResult& result);

/// Returns the verdict in words: "simulation changed (renderer unchanged)".
std::string meaning(const CaseResult& result);

/// Returns the difference of the first body to differ: "position y 7.4e-03 m (at frame 30)".
std::string change_text(const FirstChange& first);

}  // namespace substep::golden
