#pragma once
/// The folder that a check writes to, so that nobody takes what lies there for what it is not: results of the
/// check before are gone before anything is read, those of this one are written as they come and say until
/// the end that they are not all, and no two checks write at once.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "golden/check/check_results.h"

namespace substep::golden {

class CheckOutput {
 public:
  /// Makes the folder and removes the results of a check before. Throws Error when another check writes
  /// there.
  explicit CheckOutput(std::filesystem::path folder);
  ~CheckOutput();
  CheckOutput(const CheckOutput&) = delete;
  CheckOutput& operator=(const CheckOutput&) = delete;

  void start(const Suite& suite, const CheckOptions& options, std::size_t cases);
  void set_made_with(const nlohmann::ordered_json& made_with);
  void add_case(nlohmann::ordered_json entry);

  /// All is there: writes the report, too. Returns the results.
  const nlohmann::ordered_json& finish(const std::vector<std::filesystem::path>& orphans);

  /// The check ends for what `why` says: junit.xml says so.
  void fail(const std::string& why) const;

 private:
  void write(bool now);

  std::filesystem::path folder_;
  int lock_ = -1;
  nlohmann::ordered_json results_;
  double last_written_ = -1e9;  ///< s
};

}  // namespace substep::golden
