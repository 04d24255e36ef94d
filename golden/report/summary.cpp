#include "golden/report/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "golden/report/case_commands.h"
#include "golden/report/failure_groups.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t most_rows = 50;  // GitHub takes a summary of 1 MB; a person reads fewer
constexpr std::size_t most_thumbnails = 8;
constexpr std::size_t most_annotations = 10;  // what GitHub shows of a step

/// Text in a table of Markdown: nothing in it is taken for markup.
std::string cell(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      result += ' ';
      continue;
    }
    if (std::string_view("\\`*_{}[]<>()#+!|~&").find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

/// Text in a workflow command.
std::string in_command(const std::string& text, bool is_property) {
  std::string result;
  for (const char c : text) {
    const bool is_escaped = c == '%' || c == '\r' || c == '\n' || (is_property && (c == ':' || c == ','));
    if (is_escaped) {
      result += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      result += c;
    }
  }
  return result;
}

/// A command on a line of its own, in a fence longer than any in it.
std::string block(const std::string& command) {
  return fmt::format("````sh\n{}\n````\n", command);
}

/// Where a case's picture before and after is, or a new case's; empty: it has none.
std::string picture_of(const Json& entry) {
  if (entry.contains("flicker")) {
    return fmt::format("{}/{}", entry.at("files").get<std::string>(),
                       entry.at("flicker").at("file").get<std::string>());
  }
  if (!entry.contains("pairs") || entry.at("pairs").empty()) return {};
  return fmt::format("{}/{}", entry.at("files").get<std::string>(),
                     entry.at("pairs").back().at("actual").get<std::string>());
}

/// One for each origin of failures, of its simplest case.
std::string thumbnails(const std::vector<FailureGroup>& groups) {
  std::string text;
  std::size_t count = 0;
  for (const FailureGroup& group : groups) {
    const Json& entry = *group.cases.front();
    const std::string picture = picture_of(entry);
    if (picture.empty() || ++count > most_thumbnails) continue;
    const bool flickers = entry.contains("flicker");
    const int frame = (flickers ? entry.at("flicker") : entry.at("pairs").back()).at("frame");
    const std::string what = fmt::format("{}, frame {}{}", entry.at("name").get<std::string>(), frame,
                                         flickers ? ", before and after" : ", new");
    text += fmt::format("\n![{0}]({1})\n{0}\n", cell(what), picture);
  }
  return text;
}

std::string row(const Json& entry) {
  const Json& poses = entry.at("poses");
  std::string first = "–";
  if (poses.contains("motion") && poses.at("motion").at("first_frame").get<int>() >= 0) {
    first = fmt::format("{}", poses.at("motion").at("first_frame").get<int>());
  }
  const std::string picture = picture_of(entry);
  return fmt::format("| {} | {} | {} | {} | {} |\n", cell(entry.at("name")), cell(entry.at("verdict")),
                     cell(entry.at("cause")), first,
                     picture.empty() ? "–" : fmt::format("[see]({})", picture));
}

std::string summary(const Json& results, const ResultsPlace& place) {
  std::string text = fmt::format("### substep check: {}\n\n", cell(results.at("totals")));
  if (results.contains("missing")) {
    for (const Json& part : results.at("missing")) text += fmt::format("**{}**\n\n", cell(part));
  }
  const std::vector<FailureGroup> groups = failure_groups(results);
  for (const FailureGroup& group : groups) text += fmt::format("- {}\n", cell(group.line()));
  for (const Json& orphan : results.at("orphans")) {
    text += fmt::format("- orphan: {}\n", cell(orphan.at("file")));
  }
  if (groups.empty()) return text;
  text += thumbnails(groups);
  text += "\n| case | verdict | cause | first frame | before and after |\n|---|---|---|---|---|\n";
  std::size_t rows = 0;
  for (const FailureGroup& group : groups) {
    for (const Json* entry : group.cases) {
      if (++rows <= most_rows) text += row(*entry);
    }
  }
  if (rows > most_rows) text += fmt::format("\nand {} more in the report\n", rows - most_rows);
  const std::string folder = place.output.filename().string();
  text +=
      "\nTo look and to approve, download the report's artifact, open `report.html` in it and, in the "
      "repository:\n\n";
  return text + block(fmt::format("substep check --merge {}", shell_word(folder)));
}

std::string annotations(const Json& results) {
  std::string text;
  std::size_t count = 0;
  for (const FailureGroup& group : failure_groups(results)) {
    if (++count > most_annotations) break;
    text += fmt::format("::error file={},title={}::{}\n",
                        in_command(group.cases.front()->at("scene").get<std::string>(), true),
                        in_command("substep check: " + group.verdict, true), in_command(group.line(), false));
  }
  return text;
}

}  // namespace

fs::path summary_file(const fs::path& output) {
  return output / "summary.md";
}

fs::path annotations_file(const fs::path& output) {
  return output / "annotations.txt";
}

void write_summary(const Json& results, const fs::path& output) {
  write_file(summary_file(output), summary(results, place_of(results, output)));
  write_file(annotations_file(output), annotations(results));
}

}  // namespace substep
