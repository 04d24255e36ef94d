#pragma once
/// Makes what the last check produced the new goldens.
///
/// Copies and never runs anything again: what a person looked at is what is approved. Refuses, and then
/// writes nothing at all, when a file is no longer what the check left or a golden no longer what it saw,
/// when it was not the pinned renderer that drew, and when a picture is blank. Deletes nothing. A case's
/// sidecar is written last: an interrupted approval shows in the next check, and the same command does
/// the rest.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace substep::golden {

struct ApproveOptions {
  std::filesystem::path suite = "golden/suite.toml";
  std::filesystem::path output = "out/check";  ///< of the check
  std::vector<std::string> cases;              ///< names; of cases that pass an outdated sidecar is renewed
  bool all_failed = false;                     ///< every case that did not pass, too
  std::string reason;                          ///< kept in the sidecars
};

struct Approval {
  std::vector<std::filesystem::path> written;
  std::int64_t size_change = 0;           ///< bytes
  std::vector<std::string> already_good;  ///< chosen cases that had passed or were approved before
};

/// Throws Error saying why not.
Approval approve(const ApproveOptions& options);

}  // namespace substep::golden
