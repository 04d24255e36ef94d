#pragma once
/// The suite file: the scenes that are checked, their runs, and the frames that are kept as pictures.
///
///     [defaults]                      # a [[case]] may override each key
///     frames = 120                    # steps to run
///     full_every = 10                 # the golden pose log has the poses of every 10th frame
///     images = [60, 120]              # frames kept as pictures; each must have its poses in the log
///     size = [320, 180]               # of the pictures, pixels
///     algorithms = ["a1", "a2", "a3", "a4", "a5"]
///     renderer = "pinned"             # or "any": pictures are exact on the renderer that drew them
///     time_limit = 120                # s for the check, or for `command`; longer is an error
///     tolerance = { hard = 64, level = 3, count = 20 }   # or { flip = 0.3 }: image_comparison.h
///
///     [defaults.settings]             # settings_fields.h; else usual_settings() of the scene
///     substeps = 4
///
///     [defaults.settings.a2]          # for one algorithm
///     iterations = 40
///
///     [[case]]                        # one golden case per algorithm
///     scene = "../scenes/box_stack.gltf"    # relative to the suite file
///     tolerance = { count = 400 }     # its other keys stay as in [defaults]
///     pose_tolerance = {position = 1e-4, orientation = 1e-3, energy = 0.02, penetration = 1e-3, resting = 1}
///
///     [[case]]                        # a run made elsewhere, in place of `algorithms`: one case
///     scene = "../scenes/arm.gltf"
///     command = ["python3", "../arm.py", "{scene}", "{settings}", "{poses}"]   # engines.h
///
///     [[case]]
///     scene = "../scenes/arm.gltf"
///     poses = "../out/arm.csv"        # a pose table; not in [defaults]
///
/// Without a `pose_tolerance` (motion_comparison.h) poses must be the golden ones bit for bit. Of the
/// settings, a run made elsewhere uses only step, iterations and substeps; a table is compared up to `frames`
/// or its end. Commands of several cases may run at once.
///
/// A case is named after its scene file and algorithm, or the file that its command runs, or its table:
/// box_stack.a4, box_stack.arm. A second [[case]] of the same names needs a `variant = "stable"`:
/// box_stack.a4-stable. The goldens stand beside the suite file:
/// poses/<scene>/<algorithm>.poses and .track, images/<scene>/<algorithm>.f0060.png and
/// images/<scene>/<algorithm>.json. So any folder with a suite.toml, in any project, is a suite.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "golden/compare/image_comparison.h"
#include "golden/compare/motion_comparison.h"
#include "sim/model/settings.h"
#include "sim/scene/scene.h"
#include "sim/study/engines/engines.h"

namespace substep::golden {

struct SuiteCase {
  std::string name;                            ///< "box_stack.a4"
  std::filesystem::path scene;                 ///< file
  Settings settings;                           ///< without the scene's own, which settings_for() adds
  std::vector<std::string_view> own_settings;  ///< the fields that the suite sets
  std::string author;                          ///< name of the other program that made the run; empty: ours
  std::filesystem::path poses;                 ///< pose table of the run; empty: `command` writes it
  Command command;
  int frames = 120;
  int full_every = 10;
  std::vector<int> images;
  int width = 320;
  int height = 180;
  ImageTolerance tolerance;
  std::optional<PoseTolerance> pose_tolerance;
  bool any_renderer = false;  ///< whether pictures of any renderer can be approved, and are exact on it
  double time_limit = 120;    ///< s; for `command`, or for the check of another case

  std::filesystem::path suite_folder;  ///< where the goldens are
  std::filesystem::path pose_file;     ///< the golden pose log
  std::filesystem::path track_file;    ///< see track.h
  std::filesystem::path sidecar;       ///< provenance of the goldens
  std::filesystem::path image_file(int frame) const;

  /// Returns `settings` with the scene's step, sub-steps, iterations and joints where the suite does not set
  /// them.
  Settings settings_for(const Scene& loaded) const;
};

struct Suite {
  std::filesystem::path file;
  std::vector<SuiteCase> cases;

  std::filesystem::path folder() const { return file.parent_path(); }
};

/// Returns true where a name of a scene or variant has only letters, digits, _ and -, and begins with no -.
bool is_case_name(std::string_view name);

/// Reads a suite; `file` may also be the folder of a suite.toml. Throws Error with file and line for anything
/// that is unknown, missing, of a wrong type or out of range.
Suite read_suite(const std::filesystem::path& file);

/// Returns true where `name` is the case's, or its scene's: "box_stack" names all cases of that scene.
bool is_named(std::string_view case_name, std::string_view name);

/// Returns the cases of these names (is_named()), in the suite's order. Without names returns all. Throws
/// Error for an unknown name.
std::vector<SuiteCase> select(const Suite& suite, const std::vector<std::string>& names);

/// Returns the files in poses/ and images/ that belong to no case, and folders there that cannot be read,
/// sorted, but for hidden files and those of file managers.
std::vector<std::filesystem::path> orphans(const Suite& suite);

}  // namespace substep::golden
