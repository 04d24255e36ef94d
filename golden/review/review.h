#pragma once
/// A check's report served to this machine's browser, with buttons that approve and reject.
///
/// Served on the loopback address only, below a word that nobody can guess; what changes something must come
/// from that page itself, by its Origin, so that no other page that is open in the browser can. Approving
/// does what approve() does. What is rejected is noted in rejected.json in the results' folder.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace substep {

struct ReviewOptions {
  std::filesystem::path suite = "golden/suite.toml";
  std::filesystem::path output = "out/check";  ///< of the check
  int port = 0;                                ///< 0: any that is free
};

struct Review {
  std::vector<std::string> approved;  ///< names of cases
  std::vector<std::string> rejected;
  std::vector<std::string> left;  ///< failing and neither
};

/// Serves until the page says that it is done, or no case is left. `ready(address)` is called once it
/// listens. Throws Error when there are no results, or the port is taken.
Review review(const ReviewOptions& options, const std::function<void(const std::string& address)>& ready);

}  // namespace substep
