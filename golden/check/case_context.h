#pragma once
/// Internal to check(): the cases one after another, and the steps of a case's check in
/// their order. Each step reads what the steps before it left.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "golden/check/case_pictures.h"
#include "golden/check/check.h"
#include "golden/check/check_results.h"
#include "golden/compare/motion_comparison.h"
#include "golden/compare/track.h"
#include "golden/suite/sidecar.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// The cases of a check.
struct CheckPlan {
  Suite suite;
  CheckOptions options;  ///< with the suite's file
  std::vector<SuiteCase> cases;
};

/// Reads the suite, calls `run`, and writes results and report. Throws Error.
void check_with(const CheckOptions& options, const std::function<void(const CheckPlan&, CheckOutput&)>& run);

/// Checks cases one after another. Those of one scene follow each other, so that it is loaded once.
class CaseChecker {
 public:
  CaseChecker(const CheckOptions& options, const MadeWith& made_with)
      : options_(options), made_with_(made_with) {}

  /// Errors in the case become its verdict.
  CheckedCase check(const SuiteCase& entry);

 private:
  const CheckOptions& options_;
  const MadeWith& made_with_;
  std::filesystem::path scene_file_;
  std::optional<Scene> scene_;
};

/// Checks a case, and prepares its approval.
CheckedCase check_case(const CheckOptions& options, const MadeWith& made_with, const SuiteCase& entry,
                       const Scene& scene);

/// Returns the result of a case that could not be checked.
CheckedCase failed_case(const CheckOptions& options, const SuiteCase& entry, const std::string& why);

/// Returns what cases are made with here. Starts the renderer only where a case has pictures.
MadeWith made_with_here(const CheckPlan& plan);

/// A case while check_case() checks it.
struct CaseContext {
  LoggedMotion golden_motion() const { return {&*golden, golden_track ? &*golden_track : nullptr}; }
  LoggedMotion live_motion() const { return {&*live, &*live_track}; }

  void note(std::string text) { result.notes.push_back(std::move(text)); }

  /// Returns true where pictures must be equal: on the pinned renderer, or on the renderer that drew the
  /// goldens.
  bool is_exact_here() const {
    return result.entry.any_renderer ? sidecar.platform == made_with.platform : made_with.is_pinned;
  }

  const CheckOptions& options;
  const MadeWith& made_with;
  const Scene& scene;
  CaseResult result;
  Sidecar sidecar;
  std::optional<PoseLog> golden;
  std::optional<Track> golden_track;
  std::optional<PoseLog> live;
  std::optional<Track> live_track;
  std::vector<std::string> edited;  ///< golden files that are not those that were approved
  std::vector<Drawing> drawn;       ///< the golden poses, a drawing a picture of the case
  std::vector<Drawing> new_images;  ///< the live ones, where they are needed
};

/// Reads sidecar, golden log and track, and notes which of them are not those that were approved. Throws
/// Error when one is damaged.
void load_goldens(CaseContext& work);

/// Simulates, and compares with the golden log.
void check_poses(CaseContext& work);

/// Draws the golden poses and compares with the golden pictures, which shows what the renderer changed, and
/// with pictures of the live poses, which shows what the simulation changed. Writes the pictures that differ.
void check_images(CaseContext& work);

/// Sets verdict and cause. The first rule that applies decides:
///
///  1. new, missing      goldens are not there;
///  2. golden edited     all that fails does so against goldens whose own hash, noted when they were
///                       approved, does not hold: nobody approved them;
///  3. scene changed     the scene's file is another than the goldens were made of, and what differs in it
///                       bears on what fails (motion, pictures or both);
///  4. loading changed   the file is the same, but other masses, places, shapes or meshes are loaded of it;
///  5. simulation, renderer or both changed: what is left; on another renderer than the pictures' own, the
///                       environment.
void decide(CaseContext& work);

}  // namespace substep::golden
