#pragma once
/// A check that survives what it checks: the cases run in a process of their own. When that crashes or takes
/// too long over a case, the case is an error and another process goes on with the next.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "golden/check/check.h"

namespace substep::golden {

/// Functions that are called as a check goes on.
struct CheckWatcher {
  std::function<void(const std::string& case_name, std::size_t number, std::size_t of)> before_case;
  std::function<void(const nlohmann::ordered_json& entry)> after_case;  ///< its part of results.json
};

/// Checks as check() does; returns what results.json holds. To be called where nothing was drawn before and
/// there are no threads: the process forks. Throws Error when the suite cannot be read, another check writes
/// to the same folder, or there is no renderer.
nlohmann::ordered_json check_apart(const CheckOptions& options, const CheckWatcher& watcher);

}  // namespace substep::golden
