#pragma once
/// The suite file: which scenes are watched, how they are run, and which of their frames are kept as
/// pictures.
///
///     [defaults]                      # every key may stand in a [[case]] too, and holds there
///     frames = 120                    # steps to run
///     full_every = 10                 # the golden pose log has the poses of every 10th frame
///     images = [60, 120]              # frames kept as pictures; each must have its poses in the log
///     size = [320, 180]               # of the pictures, pixels
///     algorithms = ["a1", "a2", "a3", "a4", "a5"]
///     tolerance = { hard = 64, level = 3, count = 20, mean = 0.5, tile_mean = 4 }   # image_comparison.h
///     [defaults.settings]             # settings.h; what is not named is the library's default, the step the
///     scene's substeps = 4 [defaults.settings.a2]          # for one algorithm iterations = 40
///
///     [[case]]                        # one golden case per algorithm
///     scene = "../scenes/box_stack.gltf"    # relative to the suite file
///
/// A case is named after its scene file and algorithm: box_stack.a4. A second [[case]] of the same scene and
/// algorithm needs a `variant = "stable"`: box_stack.a4-stable. The goldens stand beside the suite file:
/// poses/<scene>/<algorithm>.poses, images/<scene>/<algorithm>.f0060.png and images/<scene>/<algorithm>.json.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "golden/image_comparison.h"
#include "sim/settings.h"

namespace substep {

struct SuiteCase {
  std::string name;             ///< "box_stack.a4"
  std::filesystem::path scene;  ///< file
  Settings settings;            ///< `settings.step` holds only when `own_step`
  bool own_step = false;        ///< the suite sets the step; else the scene does
  int frames = 120;
  int full_every = 10;
  std::vector<int> images;
  int width = 320;
  int height = 180;
  ImageTolerance tolerance;

  std::filesystem::path pose_file;  ///< the golden pose log
  std::filesystem::path sidecar;    ///< what its goldens were made with
  std::filesystem::path image_file(int frame) const;
};

struct Suite {
  std::filesystem::path file;
  std::vector<SuiteCase> cases;

  std::filesystem::path folder() const { return file.parent_path(); }
};

/// Throws Error with file and line for anything that is unknown, missing, of a wrong type or out of range.
Suite read_suite(const std::filesystem::path& file);

/// The cases of these names, in the suite's order; "box_stack" stands for all cases of that scene. Empty:
/// all. Throws Error for a name that is none.
std::vector<SuiteCase> select(const Suite& suite, const std::vector<std::string>& names);

/// Files in poses/ and images/ that belong to no case, sorted.
std::vector<std::filesystem::path> orphans(const Suite& suite);

}  // namespace substep
