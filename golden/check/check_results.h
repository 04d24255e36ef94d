#pragma once
/// results.json: every figure of a check, what approving would copy, and all that the report shows.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "golden/check/check.h"

namespace substep {

/// A file that approving would copy over a golden, with the contents of both as the check saw them.
struct Offer {
  std::filesystem::path from;
  std::string from_hash;
  std::filesystem::path to;
  std::string to_hash;  ///< empty: there was no such golden
};

/// A picture that could be approved as good beside the golden one.
struct AlternateOffer {
  int frame = 0;
  std::filesystem::path from;
  std::string from_hash;
  std::string pixels;  ///< hash
};

struct CheckedCase {
  CaseResult result;
  std::vector<Offer> offers;
  std::vector<AlternateOffer> alternates;
  nlohmann::ordered_json sidecar;  ///< but for when and why it was approved
};

/// What was checked, as approve() needs it.
struct CheckResults {
  std::string suite_hash;
  struct Case {
    std::string name;
    std::string verdict;
    std::string refusal;
    bool poses_pass = false;
    std::filesystem::path sidecar_file;
    std::vector<Offer> offers;
    std::vector<AlternateOffer> alternates;
    nlohmann::ordered_json sidecar;
  };
  std::vector<Case> cases;
  nlohmann::ordered_json made_with;
};

std::filesystem::path results_file(const std::filesystem::path& output);

nlohmann::ordered_json results_json(const CheckResult& result, const std::vector<CheckedCase>& cases);

void write_results(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// Throws Error when there are none, or they are not what write_results wrote.
nlohmann::ordered_json read_results_json(const std::filesystem::path& output);
CheckResults read_results(const std::filesystem::path& output);

}  // namespace substep
