#pragma once
/// JSON text read strictly.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sim/error.h"

namespace substep {

/// The value of `text`. Throws nlohmann's exception for what is no JSON, and Error, with `what` at its front,
/// for an object that has a key twice: the parser by itself would keep the last, and a reader would see the
/// first.
template <typename Json>
Json parse_json(std::string_view text, const std::string& what) {
  std::vector<std::set<std::string>> open;
  return Json::parse(text, [&](int, typename Json::parse_event_t event, Json& parsed) {
    using Event = typename Json::parse_event_t;
    if (event == Event::object_start) open.emplace_back();
    if (event == Event::object_end) open.pop_back();
    if (event == Event::key && !open.back().insert(parsed.template get<std::string>()).second) {
      throw Error(fmt::format("{}: the key '{}' stands twice in one object", what,
                              parsed.template get<std::string>().substr(0, 60)));
    }
    return true;
  });
}

}  // namespace substep
