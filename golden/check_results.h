#pragma once
/// results.json: every figure of a check, and what approving would copy; and the sidecar of a case's goldens.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "golden/check.h"
#include "sim/log/pose_log.h"
#include "sim/scene/scene.h"

namespace substep {

/// A file that approving would copy over a golden, with the contents of both as the check saw them.
struct Offer {
  std::filesystem::path from;
  std::string from_hash;
  std::filesystem::path to;
  std::string to_hash;  ///< empty: there was no such golden
};

struct CheckedCase {
  CaseResult result;
  std::vector<Offer> offers;
  nlohmann::ordered_json sidecar;  ///< but for when and why it was approved
};

/// What was checked, as approve() needs it.
struct CheckResults {
  std::string suite_hash;
  struct Case {
    std::string name;
    std::string verdict;
    std::string refusal;
    std::filesystem::path sidecar_file;
    std::vector<Offer> offers;
    nlohmann::ordered_json sidecar;
  };
  std::vector<Case> cases;
  bool is_pinned = false;
};

std::filesystem::path results_file(const std::filesystem::path& output);

void write_results(const CheckResult& result, const std::vector<CheckedCase>& cases);

/// Throws Error when there are none, or they are not what write_results wrote.
CheckResults read_results(const std::filesystem::path& output);

/// What the goldens of a case were made with. `pictures` are those of entry.images.
nlohmann::ordered_json make_sidecar(const CaseResult& result, const PoseLog& log, const Scene& scene,
                                    std::span<const Image* const> pictures, const MadeWith& made_with);

/// The hash of the approved picture's pixels according to the sidecar; empty when it says nothing.
std::string approved_pixels(const std::filesystem::path& sidecar, int frame);

/// "golden made with compiler GNU 12.2.0, here Clang 14.0.6": context of a failure; empty where all is the
/// same.
std::string provenance_differences(const std::filesystem::path& sidecar, const MadeWith& here);

/// 16 hexadecimal digits of hash(image).
std::string pixel_hash(const Image& image);

}  // namespace substep
