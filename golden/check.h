#pragma once
/// Whether the simulation and the renderer still do what the goldens say, and which of the two does not.
///
/// Two independent tests a case, so that the verdict is a fact:
///
///  - poses:  the live simulation against the golden pose log, bit for bit by the hash of each frame;
///  - images: the *golden* pose log drawn by today's renderer, against the golden pictures.
///
/// A change of the solver fails the first alone, a change of the renderer the second alone. On the pinned
/// renderer pictures must be equal; on another one the case's tolerance holds, and a picture beyond it is put
/// down to the environment.
///
/// Everything that a person wants to see of a failing case lies in <output>/<case>/: actual.poses, and for
/// each picture f0060.expected.png, f0060.actual.png, f0060.difference.png; where the poses changed,
/// f0060.new.png is the live simulation's picture. <output>/results.json has every figure, and is what
/// approve() goes by. Goldens are never written here.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "golden/image_comparison.h"
#include "golden/provenance.h"
#include "golden/suite.h"
#include "sim/log/pose_log.h"

namespace substep {

enum class Verdict {
  pass,
  simulation_changed,
  renderer_changed,
  both_changed,
  environment,  ///< pictures beyond the tolerance, on a renderer that is not the pinned one
  missing,      ///< some of the case's goldens are not there
  created,      ///< none is: the case is new
};

/// "pass", "simulation changed", …, "new".
std::string_view name(Verdict verdict);

struct FlipSummary {
  double mean = 0, percentile_99 = 0, max = 0;
  std::string visibility;
};

/// A picture against another. `flip` where they differ and have one size.
struct PictureComparison {
  ImageComparison image;
  std::optional<FlipSummary> flip;
};

struct PoseResult {
  bool is_checked = false;
  bool has_golden = false;
  bool passes = false;
  PoseDifference difference;
  std::string body;  ///< name of difference.body
  int frames = 0;    ///< of the live run, frame 0 included
  int golden_frames = 0;
  std::string end;  ///< how the live run ended: pose_log.h
};

struct ImageResult {
  int frame = 0;
  bool has_golden = false;
  bool is_drawn = false;  ///< from the golden poses
  bool passes = false;
  bool is_blank = false;
  std::optional<PictureComparison>
      against_golden;                          ///< golden poses, this renderer, against the golden picture
  std::optional<PictureComparison> new_poses;  ///< new against golden poses, both by this renderer
};

struct CaseResult {
  SuiteCase entry;
  double step = 0;  ///< s
  Verdict verdict = Verdict::pass;
  PoseResult poses;
  bool images_checked = false;
  std::vector<ImageResult> images;
  std::vector<std::string> notes;  ///< context, never a reason to fail
  std::string refusal;             ///< why approve() will not take it; empty: it will
  std::filesystem::path files;     ///< the folder with its files
};

struct CheckOptions {
  std::filesystem::path suite = "golden/suite.toml";
  std::filesystem::path output = "out/check";
  std::vector<std::string> cases;  ///< see select(); empty: all, and orphans are looked for
  bool poses = true;
  bool images = true;
};

struct CheckResult {
  CheckOptions options;
  MadeWith made_with;
  std::vector<CaseResult> cases;
  std::vector<std::filesystem::path> orphans;

  /// 0: all pass. 1: something differs, is new, missing or an orphan. 3: nothing but the environment.
  int exit_code() const;
};

/// `after_case(result, number, of)` is called after each case; may be empty. Throws Error when the suite, a
/// scene or a golden cannot be read.
CheckResult check(const CheckOptions& options,
                  const std::function<void(const CaseResult&, int number, int of)>& after_case = {});

/// What a person should know of a case that does not pass: several lines, each ended.
std::string explain(const CaseResult& result, const CheckOptions& options);

/// "3 simulation changed, 0 renderer changed, … 30 pass": one line.
std::string totals(const CheckResult& result);

}  // namespace substep
