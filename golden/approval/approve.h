#pragma once
/// Makes the results of the last check the new goldens.
///
/// Copies files (pictures compressed better) and runs nothing again, so that a person approves what he looked
/// at. Refuses, and writes nothing, where a file, a golden or a scene changed since the check, a picture is
/// blank, or the renderer is not the pinned one (unless renderer = "any"). Deletes nothing. A
/// case's sidecar is written last, so that the next check shows an interrupted approval, and the same command
/// completes it.

#include <filesystem>
#include <string>
#include <vector>

namespace substep::golden {

struct ApproveOptions {
  std::filesystem::path suite = "golden/suite.toml";
  std::filesystem::path output = "out/check";  ///< folder of the check's results
  std::vector<std::string> cases;  ///< names, see is_named(); one that passes gets outdated files renewed
  bool all_failed = false;         ///< every case that did not pass, too
  std::string reason;              ///< kept in the sidecars
};

struct Approval {
  std::vector<std::filesystem::path> written;
  std::vector<std::string> already_good;  ///< chosen cases for which nothing had to be written
};

/// Approves the cases. Throws Error where it refuses.
Approval approve(const ApproveOptions& options);

}  // namespace substep::golden
