#pragma once
/// Runs the suite: checks that the simulation still gives the golden poses, and that the renderer still draws
/// the golden pictures of them.
///
/// Each case has two independent tests:
///   poses   the live run against the golden pose log, bit for bit or in tolerance (motion_comparison.h);
///   images  the *golden* pose log, drawn now, against the golden pictures (image_comparison.h).
///
/// A change of the solver fails the first alone, a change of the renderer the second alone. Pictures must be
/// equal where CaseContext::is_exact_here(), as on the pinned renderer; elsewhere the case's tolerance holds,
/// and a picture beyond it is reported as Verdict::environment.
///
/// The verdict of a case that fails because its inputs changed names the input: the scene's file, the loaded
/// scene, or a golden that was edited after its approval (decide(), case_context.h). A case that cannot be
/// checked at all is an error, and the other cases are checked.
///
/// <output>/<case>/ has a failing case's new pose log and track, the pictures that PicturePair names, and a
/// page that plays both runs. <output>/results.json has every figure; approve() and the report read it.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "golden/compare/flip.h"
#include "golden/compare/image_comparison.h"
#include "golden/compare/motion_comparison.h"
#include "golden/compare/verdict.h"
#include "golden/suite/suite.h"
#include "sim/loading/json_value.h"
#include "sim/log/pose_log.h"

namespace substep::golden {

/// A comparison of two pictures. `flip` and `blame` are set where the pictures differ and have the same size.
struct PictureComparison {
  ImageComparison image;
  std::optional<Flip> flip;
  std::optional<Blame> blame;
};

struct PoseResult {
  bool has_golden = false;
  bool passes = false;
  PoseDifference difference;
  MotionComparison motion;
  int visible_frame = -1;  ///< first whose pictures of old and new poses differ; −1: none, or not drawn
  bool visible_frame_is_certain = false;  ///< whether all frames up to it could be drawn
  int frames = 0;                         ///< of the live run, frame 0 included
  int golden_frames = 0;
  std::string end;  ///< how the live run ended: pose_log.h
  int bodies = 0;   ///< in the live run, but for the world
};

struct ImageResult {
  int frame = 0;
  bool has_golden = false;
  bool is_drawn = false;  ///< whether the golden poses could be drawn
  bool passes = false;
  bool is_blank = false;       ///< whether a picture drawn here, of golden or live poses, is blank
  bool must_be_exact = false;  ///< whether no tolerance holds on this renderer
  /// The golden poses, drawn here, against the golden picture.
  std::optional<PictureComparison> against_golden;
  std::optional<PictureComparison> new_poses;  ///< new poses against golden ones, both drawn here
};

/// Two pictures for a person to compare, and a picture of their difference: files in the case's folder, empty
/// where missing.
struct PicturePair {
  enum class About { renderer, simulation, first_visible, only };  ///< `only`: a picture without a golden
  About about = About::renderer;
  int frame = 0;
  std::string expected;
  std::string actual;
  std::string flip;  ///< heat map
  PictureComparison comparison;
};

/// A file that approval would copy over a golden, with the hashes of both during the check. Since both
/// folders may move, results.json has `from` relative to its own folder and `to` relative to the suite's.
struct ApprovalCandidate {
  std::filesystem::path from;
  std::string from_hash;
  std::filesystem::path to;
  std::string to_hash;  ///< empty: there was no such golden
};

struct CaseResult {
  SuiteCase entry;  ///< with the settings of its run
  Verdict verdict = Verdict::pass;
  PoseResult poses;
  std::vector<ImageResult> images;
  std::vector<PicturePair> pairs;
  std::vector<std::string> notes;  ///< context, never a reason to fail
  std::string player;              ///< page that plays the run beside the golden one; empty: none
  std::string cause;               ///< cause of the failure in a few words; empty: unknown
  std::string refusal;             ///< why approve() refuses the case; empty: it accepts
  std::filesystem::path files;     ///< the folder with its files
  double seconds = 0;              ///< time of the check, without loading the scene
  std::vector<ApprovalCandidate> candidates;
  Json sidecar;  ///< written by approval, which adds date and reason
};

struct CheckOptions {
  std::filesystem::path suite = "golden/suite.toml";
  std::filesystem::path output = "out/check";
  std::vector<std::string> cases;  ///< see select(); empty: all, and orphans are reported
};

/// Functions that a check calls: `before_case` as each case begins, `after_case` once for each case, in the
/// suite's order.
struct CheckWatcher {
  std::function<void(const std::string& case_name, std::size_t number, std::size_t of)> before_case;
  std::function<void(const Json& entry)> after_case;  ///< its part of results.json
};

/// Checks the cases in worker processes, one for each processor. A crash or an exceeded time limit becomes
/// the case's verdict, an error, and a new worker takes the next case. Returns the content of results.json.
/// Call it before drawing and without other threads, since the process forks. Throws Error when the suite
/// cannot be read, another check writes to the same folder, or there is no renderer.
Json check(const CheckOptions& options, const CheckWatcher& watcher);

std::filesystem::path results_file(const std::filesystem::path& output);

/// Returns the results that a check wrote. Throws Error when there are no results, or they are damaged.
Json read_results(const std::filesystem::path& output);

}  // namespace substep::golden
