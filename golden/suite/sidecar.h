#pragma once
/// The sidecar of a case: provenance, hashes and content of its goldens, date and reason of their approval. A
/// case without a sidecar is `missing`; a golden that differs from its hash is `golden edited`. Digests of
/// the scene's parts tell which part of a body differs between two scenes.

#include <filesystem>
#include <string>
#include <vector>

#include "golden/compare/image_comparison.h"
#include "golden/compare/provenance.h"
#include "golden/suite/suite.h"
#include "sim/loading/json_value.h"
#include "sim/log/pose_log.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// The notes of a case's approval; empty where there is no sidecar.
struct Sidecar {
  bool is_there = false;
  struct Picture {
    int frame = 0;
    std::string pixels;  ///< hash of the picture that was approved
    std::vector<BodyExtent> bodies;
  };
  std::vector<Picture> pictures;
  std::string scene_hash;
  Json parts;                 ///< scene_parts()
  std::string pose_log_hash;  ///< content hash of the approved pose log
  std::string track_hash;
  Json run;  ///< settings, frames and size of pictures
  Json made_with;
  std::string platform;  ///< where the golden pictures were drawn

  const Picture* picture(int frame) const;
};

/// Reads a sidecar, if there is one. Throws Error where it is damaged.
Sidecar read_sidecar(const std::filesystem::path& file);

/// Returns the sidecar of goldens made here: a run's log, the hash of its track's file, and its pictures.
Json make_sidecar(const SuiteCase& entry, const PoseLog& log, const std::string& track_hash,
                  const Scene& scene, const std::vector<Sidecar::Picture>& pictures,
                  const MadeWith& made_with);

/// Returns the settings of a case's run. A run of another program has its author in place of the algorithm.
Json run_settings(const SuiteCase& entry);

/// Returns the sidecar's file as text.
std::string sidecar_text(const Json& sidecar);

Json to_json(const MadeWith& made_with);

/// Returns "substeps 10, here 20; frames 60, here 90"; empty where all settings are equal.
std::string settings_differences(const Sidecar& sidecar, const SuiteCase& entry);

/// Returns "compiler GNU 12.2.0, here Clang 14.0.6"; empty where all is equal.
std::string provenance_differences(const Sidecar& sidecar, const MadeWith& here);

/// Returns digests of four hexadecimal digits, by kind of part: of the world, of camera and light, of each
/// body in the order of Scene::bodies, and of each joint in the order of Scene::joints.
Json scene_parts(const Scene& scene);

/// The differences between a scene and the noted parts of another.
struct SceneDifference {
  bool moves = false;     ///< something that motion depends on differs
  bool is_drawn = false;  ///< something that is drawn differs
  std::string text;       ///< "mass of box_3; mesh or colour of a, b, c, d and 5 more"; empty: nothing
};

/// Compares a scene with noted digests. `names` are the noted bodies' names from the pose log; empty without
/// a log.
SceneDifference scene_difference(const Json& noted, const Scene& scene,
                                 const std::vector<std::string>& names);

}  // namespace substep::golden
