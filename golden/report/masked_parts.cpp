#include "golden/report/masked_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "render/markup.h"

namespace substep {
namespace {

using Json = nlohmann::ordered_json;

/// A line of the table.
struct Part {
  std::string name;  ///< the case's
  std::string what;
  std::string reason;
  std::string found;
  std::string limit;
  bool differs = false;
  bool passes = true;
};

Part part_of_picture(const Json& part, const std::string& name, int frame) {
  const auto limit = part.at("limit").get<std::string>();
  return {name,
          fmt::format("frame {}: {}", frame, part.at("what").get<std::string>()),
          part.at("reason"),
          part.at("found"),
          limit.empty() ? "any" : limit,
          part.at("differing").get<std::int64_t>() > 0,
          part.at("pass")};
}

Part part_of_poses(const Json& part, const std::string& name) {
  const double position = part.at("position");
  const double orientation = part.at("orientation");
  const double most_position = part.at("position_limit");
  const double most_orientation = part.at("orientation_limit");
  return {name,
          "poses of body " + part.at("body").get<std::string>(),
          part.at("reason"),
          fmt::format("{:.2g} m, {:.2g} rad", position, orientation),
          fmt::format("{:g} m, {:g} rad", most_position, most_orientation),
          position > 0 || orientation > 0,
          position <= most_position && orientation <= most_orientation};
}

std::vector<Part> parts_of(const Json& entry) {
  std::vector<Part> parts;
  const auto name = entry.at("name").get<std::string>();
  for (const Json& image : entry.at("images")) {
    if (!image.contains("masked")) continue;
    for (const Json& part : image.at("masked")) {
      parts.push_back(part_of_picture(part, name, image.at("frame")));
    }
  }
  if (!entry.contains("tolerated")) return parts;
  for (const Json& part : entry.at("tolerated")) parts.push_back(part_of_poses(part, name));
  return parts;
}

}  // namespace

std::size_t cases_that_differ_masked(const Json& results) {
  const Json& cases = results.at("cases");
  return static_cast<std::size_t>(std::count_if(cases.begin(), cases.end(), [](const Json& entry) {
    const std::vector<Part> parts = parts_of(entry);
    return std::any_of(parts.begin(), parts.end(), [](const Part& part) { return part.differs; });
  }));
}

std::string masked_table(const Json& results) {
  std::vector<Part> parts;
  for (const Json& entry : results.at("cases")) {
    for (Part& part : parts_of(entry)) parts.push_back(std::move(part));
  }
  if (parts.empty()) return {};
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Part& a, const Part& b) { return a.differs > b.differs; });
  std::string rows;
  for (const Part& part : parts) {
    const std::string found = part.passes ? escaped(part.found) : "<mark>" + escaped(part.found) + "</mark>";
    rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        escaped(part.name), escaped(part.what), escaped(part.reason),
                        part.differs ? found : "nothing", escaped(part.limit));
  }
  return fmt::format(
      "<details class=\"masked\"{}><summary>{} masked parts of pictures and bodies with tolerances of their "
      "own; "
      "{} differ</summary>\n<div class=\"wide\"><table><tr><th>case</th><th>what</th><th>why</th><th>what "
      "differs "
      "there</th><th>what may</th></tr>\n{}</table></div></details>\n",
      parts.front().differs ? " open" : "", parts.size(),
      std::count_if(parts.begin(), parts.end(), [](const Part& part) { return part.differs; }), rows);
}

}  // namespace substep
