#include "golden/report/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "golden/compare/verdict.h"

namespace substep::golden {
namespace {

using Json = nlohmann::ordered_json;

std::string algorithm_of(const Json& entry) {
  return entry.at("settings").at("algorithm");
}

int bodies_of(const Json& entry) {
  return entry.at("poses").value("bodies", 0);
}

/// Returns which cases fail: "all cases of a3, no others".
std::string common_part(const std::vector<const Json*>& failing, const Json& checked) {
  if (failing.size() == checked.size()) return "all cases";
  std::set<std::string> algorithms;
  std::set<std::string> scenes;
  for (const Json* entry : failing) {
    algorithms.insert(algorithm_of(*entry));
    scenes.insert(entry->at("scene").get<std::string>());
  }
  const auto of_algorithm = std::count_if(checked.begin(), checked.end(), [&](const Json& entry) {
    return algorithm_of(entry) == *algorithms.begin();
  });
  if (algorithms.size() == 1 && static_cast<std::size_t>(of_algorithm) == failing.size()) {
    return fmt::format("all cases of {}, no others", *algorithms.begin());
  }
  return fmt::format("{} of {} cases, of {} scene{}, all {}", failing.size(), checked.size(), scenes.size(),
                     scenes.size() == 1 ? "" : "s", fmt::join(algorithms, " "));
}

std::string first_frames(const std::vector<const Json*>& failing) {
  std::set<int> frames;
  for (const Json* entry : failing) {
    if (entry->at("poses").contains("motion"))
      frames.insert(entry->at("poses").at("motion").at("first_frame").get<int>());
  }
  frames.erase(-1);
  if (frames.empty()) return {};
  if (frames.size() == 1) return fmt::format(", from frame {} on", *frames.begin());
  return fmt::format(", from frame {} to {} on", *frames.begin(), *frames.rbegin());
}

/// Returns a key that separates the groups of one verdict. A change of the program is one group, however many
/// cases fail; cases whose inputs differ alike are one group.
std::string origin_key(const Json& entry) {
  const auto verdict = verdict_named(entry.at("verdict").get<std::string>());
  const auto cause = entry.at("cause").get<std::string>();
  const bool is_of_input =
      verdict == Verdict::error || verdict == Verdict::scene_changed || verdict == Verdict::loading_changed;
  return is_of_input || cause == "light, camera or sky" ? cause : std::string();
}

FailureGroup group_of(const std::string& verdict, const std::string& key, std::vector<const Json*> cases,
                      const Json& checked) {
  std::stable_sort(cases.begin(), cases.end(),
                   [](const Json* a, const Json* b) { return bodies_of(*a) < bodies_of(*b); });
  const std::string which = common_part(cases, checked) + first_frames(cases);
  return {verdict, fmt::format("{}{}{}", key, key.empty() ? "" : ", ", which), std::move(cases)};
}

}  // namespace

std::string FailureGroup::line() const {
  const auto simplest = cases.front()->at("name").get<std::string>();
  if (cases.size() == 1) {
    const auto cause = cases.front()->at("cause").get<std::string>();
    return fmt::format("{}, {}{}{}", simplest, verdict, cause.empty() ? "" : ": ", cause);
  }
  return fmt::format("{} cases, {}: {}; simplest: {}", cases.size(), verdict, origin, simplest);
}

std::vector<FailureGroup> failure_groups(const Json& results) {
  const Json& checked = results.at("cases");
  std::vector<FailureGroup> groups;
  for (const std::string_view verdict : verdict_names) {
    if (verdict == "pass") continue;
    std::map<std::string, std::vector<const Json*>> by_origin;
    for (const Json& entry : checked) {
      if (entry.at("verdict") == verdict) by_origin[origin_key(entry)].push_back(&entry);
    }
    std::vector<FailureGroup> found;
    found.reserve(by_origin.size());
    for (auto& [key, cases] : by_origin) {
      found.push_back(group_of(std::string(verdict), key, std::move(cases), checked));
    }
    std::stable_sort(found.begin(), found.end(), [](const FailureGroup& a, const FailureGroup& b) {
      return a.cases.size() > b.cases.size();
    });
    groups.insert(groups.end(), found.begin(), found.end());
  }
  return groups;
}

}  // namespace substep::golden
