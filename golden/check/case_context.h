#pragma once
/// A case while check_case checks it: what it is checked against, what was found, and what each step leaves
/// for those after it.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "golden/check/case_pictures.h"
#include "golden/check/check.h"
#include "golden/check/check_results.h"
#include "golden/compare/motion_comparison.h"
#include "golden/compare/track.h"
#include "golden/suite/sidecar.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// In the scene's order, the world first.
std::vector<std::string> body_names(const Scene& scene);

struct CaseContext {
  /// Throws Error when the sidecar is damaged.
  CaseContext(const CheckOptions& options_of, const MadeWith& with, const SuiteCase& entry, const Scene& of);

  /// Once there are both logs.
  LoggedMotion golden_motion() const { return {&*golden, golden_track ? &*golden_track : nullptr}; }
  LoggedMotion live_motion() const { return {&*live, &*live_track}; }

  void note(std::string_view text);

  /// Whether pictures must be equal here: on the pinned renderer, or on the one that they are of.
  bool is_exact_here() const;

  const CheckOptions& options;
  const MadeWith& made_with;
  const Scene& scene;
  CaseFolder folder;
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

}  // namespace substep::golden
