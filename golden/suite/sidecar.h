#pragma once
/// The sidecar of a case: provenance of its goldens, what they show, and when and why they were approved. It
/// explains a failure and never makes a case fail.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "golden/compare/blame.h"
#include "golden/compare/provenance.h"
#include "golden/suite/suite.h"
#include "sim/log/pose_log.h"
#include "sim/measure/json.h"
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
  nlohmann::ordered_json parts;  ///< scene_parts()
  std::string pose_log_hash;     ///< content hash of the approved pose log
  std::string track_hash;
  nlohmann::ordered_json made_with;
  std::string platform;  ///< that the golden pictures were approved on

  const Picture* picture(int frame) const;
};

/// Reads a sidecar, if there is one. Throws Error where it is damaged.
Sidecar read_sidecar(const std::filesystem::path& file);

/// A picture of a case that could be approved.
struct ApprovablePicture {
  const render::Image* picture = nullptr;
  std::vector<BodyExtent> bodies;
};

/// A case's run that could be approved, with the files of its logs.
struct ApprovableRun {
  const PoseLog* log = nullptr;
  std::string pose_log_hash;
  std::string track_hash;
};

/// Returns the sidecar of goldens made here. `pictures` are those of entry.images.
nlohmann::ordered_json make_sidecar(const SuiteCase& entry, const ApprovableRun& run, const Scene& scene,
                                    std::span<const ApprovablePicture> pictures, const MadeWith& made_with);

/// Returns the settings of a case's run. A run made elsewhere has its name in place of the algorithm.
nlohmann::ordered_json run_settings(const SuiteCase& entry);

/// Returns the sidecar's file as text.
std::string sidecar_text(const nlohmann::ordered_json& sidecar);

nlohmann::ordered_json to_json(const MadeWith& made_with);

/// "golden made with compiler GNU 12.2.0, here Clang 14.0.6": context of a failure; empty where all is the
/// same.
std::string provenance_differences(const Sidecar& sidecar, const MadeWith& here);

/// 16 hexadecimal digits of hash(image).
std::string pixel_hash(const render::Image& image);

}  // namespace substep::golden
