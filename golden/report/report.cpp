#include "golden/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <vector>

#include "golden/compare/provenance.h"
#include "golden/compare/verdict.h"
#include "golden/report/failures.h"
#include "render/markup.h"
#include "sim/log/file_output.h"
#include "sim/math/base64.h"

namespace substep::embedded {
std::string_view report_html();
std::string_view report_css();
std::string_view report_js();
}  // namespace substep::embedded

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

/// Returns a JSON string as text of the page.
std::string text_of(const Json& json) {
  return render::escaped(json.get<std::string>());
}

/// Returns a verdict as a class of the style sheet.
std::string css_class(std::string verdict) {
  std::ranges::replace(verdict, ' ', '-');
  return verdict;
}

/// Pictures as part of the page, or as links where it would grow too large.
struct ReportPictures {
  fs::path output;
  std::size_t budget;  ///< bytes that are left in the page

  std::string source(const fs::path& folder, const std::string& file) {
    const std::string link = (folder.filename() / file).string();
    std::error_code ignored;  // a missing file has the largest size
    if (fs::file_size(output / link, ignored) > budget) return render::escaped(link);
    const std::string data = "data:image/png;base64," + base64(read_bytes(output / link));
    if (data.size() > budget) return render::escaped(link);
    budget -= data.size();
    return data;
  }
};

std::string pair_title(const Json& pair) {
  const auto about = pair.at("about").get<std::string>();
  const std::string frame = fmt::format("Frame {}", pair.at("frame").get<int>());
  if (about == "renderer") return frame + ": golden picture, then golden poses drawn now";
  if (about == "simulation") return frame + ": changed by the simulation – golden, then new poses, drawn now";
  if (about == "first visible") return frame + ": the first whose picture differs – golden, then new poses";
  return frame + ": no golden to compare with";
}

std::string pair_block(const Json& pair, const Json& entry, ReportPictures& pictures) {
  std::string html = fmt::format("<div class=\"pair\"><h3>{}</h3>\n", pair_title(pair));
  html += "<div class=\"pictures\">\n";
  const fs::path folder = entry.at("files").get<std::string>();
  constexpr std::array<std::array<const char*, 2>, 3> kinds{
      {{"expected", "before"},
       {"actual", "after"},
       {"flip", "FLIP: black is not visible, pale yellow most"}}};
  for (const auto& [kind, caption] : kinds) {
    const auto file = pair.at(kind).get<std::string>();
    if (file.empty()) continue;
    fmt::format_to(
        std::back_inserter(html),
        "<figure><img data-what=\"{}\" loading=\"lazy\" width=\"{}\" height=\"{}\" alt=\"{} of frame "
        "{}\" src=\"{}\"><figcaption>{}</figcaption></figure>\n",
        kind, entry.at("size").at(0).get<int>(), entry.at("size").at(1).get<int>(), caption,
        pair.at("frame").get<int>(), pictures.source(folder, file), caption);
  }
  return html + "</div>\n</div>\n";
}

/// Returns a link to the page that plays the run beside its golden one, from half a second before they
/// diverge.
std::string player_link(const Json& entry) {
  const std::string file = entry.at("files").get<std::string>() + "/" + entry.at("player").get<std::string>();
  const int diverged = entry.at("poses").at("motion").at("first_frame");
  const double time = std::max(0.0, diverged * entry.at("step").get<double>() - 0.5);
  return fmt::format(
      "<p>Play it beside its golden run, and turn and measure both: <a href=\"{0}#t={1:.3f}\">{0}</a></p>\n",
      render::escaped(file), time);
}

std::string case_section(const Json& entry, const ResultsLocation& location, ReportPictures& pictures) {
  std::string html = fmt::format(
      "<section class=\"case\" id=\"{0}\">\n<header><h2>{0}</h2><span class=\"verdict "
      "{1}\">{2}</span></header>\n",
      text_of(entry.at("name")), css_class(entry.at("verdict")), text_of(entry.at("meaning")));
  if (!entry.at("cause").get<std::string>().empty()) {
    html += fmt::format("<p>Cause: <b>{}</b></p>\n", text_of(entry.at("cause")));
  }
  if (entry.contains("player")) html += player_link(entry);
  const std::string command = approve_command(entry, location);
  if (command.empty()) {
    html += fmt::format("<p class=\"quiet\">Cannot be approved from this check: {}.</p>\n",
                        text_of(entry.at("refusal")));
  } else {
    html += fmt::format("<div class=\"command\"><span>approve</span><code>{}</code></div>\n",
                        render::escaped(command));
  }
  html += fmt::format("<pre>{}</pre>\n", text_of(entry.at("text")));
  for (const Json& pair : entry.at("pairs")) html += pair_block(pair, entry, pictures);
  return html + "</section>\n";
}

/// Returns the failing cases, the gravest verdict first.
std::vector<const Json*> failing_cases(const Json& results) {
  std::vector<const Json*> cases;
  for (const Json& entry : results.at("cases")) {
    if (entry.at("verdict") != "pass") cases.push_back(&entry);
  }
  const auto rank = [](const Json* entry) { return verdict_named(entry->at("verdict").get<std::string>()); };
  std::ranges::stable_sort(cases, {}, rank);
  return cases;
}

std::string totals_list(const Json& results) {
  std::string html = "<ul class=\"totals\">\n";
  const auto add = [&](const std::string& verdict, std::size_t count) {
    if (count == 0 && verdict != "pass") return;
    html += fmt::format("<li class=\"{}{}\"><b>{}</b>{}</li>\n", css_class(verdict),
                        count == 0 ? " zero" : "", count, verdict);
  };
  const Json& cases = results.at("cases");
  for (const std::string_view verdict : verdict_names) {
    if (verdict == "pass") add("orphan", results.at("orphans").size());
    add(std::string(verdict),
        static_cast<std::size_t>(std::count_if(cases.begin(), cases.end(),
                                               [&](const Json& e) { return e.at("verdict") == verdict; })));
  }
  return html + "</ul>\n";
}

/// Returns a list of the failure groups where it is shorter than that of all failures.
std::string groups(const Json& results) {
  std::string items;
  bool is_shorter = false;
  for (const FailureGroup& group : failure_groups(results)) {
    is_shorter = is_shorter || group.cases.size() > 1;
    items += fmt::format("<li>{}</li>\n", render::escaped(group.line()));
  }
  return is_shorter ? "<h3>In short</h3>\n<ul>\n" + items + "</ul>\n" : std::string();
}

std::string passing(const Json& results) {
  std::string rows;
  std::size_t count = 0;
  for (const Json& entry : results.at("cases")) {
    if (entry.at("verdict") != "pass") continue;
    ++count;
    std::string notes;
    for (const Json& note : entry.at("notes")) notes += text_of(note) + "<br>";
    rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", text_of(entry.at("name")), notes);
  }
  if (count == 0) return {};
  return fmt::format("<details><summary>{} that pass</summary><table>\n{}</table></details>\n", count, rows);
}

std::string orphans(const Json& results) {
  if (results.at("orphans").empty()) return {};
  std::string html =
      "<h3>Orphans: goldens without a case</h3>\n<p>Delete them, or put their cases back.</p>\n<ul>\n";
  for (const Json& orphan : results.at("orphans")) html += fmt::format("<li>{}</li>\n", text_of(orphan));
  return html + "</ul>\n";
}

/// Returns the page's body, with pictures of at most `budget` bytes in it and the others linked.
std::string body(const Json& results, const fs::path& output, std::size_t budget) {
  const std::vector<const Json*> cases = failing_cases(results);
  const std::size_t all = results.at("cases").size();
  std::string outcome = fmt::format("{} of {} cases do not pass", cases.size(), all);
  if (cases.empty()) outcome = results.at("orphans").empty() ? "all cases pass" : "goldens without a case";
  std::string html = fmt::format(
      "<header class=\"top\"><h1>Visual regression: {}</h1>\n<p class=\"quiet\">{} · {} cases</p>\n", outcome,
      text_of(results.at("suite")), all);
  ReportPictures pictures{output, budget};
  html += totals_list(results) + groups(results) + orphans(results);
  html +=
      "<p class=\"keys quiet\" hidden><kbd>j</kbd> <kbd>k</kbd> next and previous case · <kbd>n</kbd> "
      "<kbd>p</kbd> pictures · <kbd>1</kbd>–<kbd>3</kbd> how to compare · <kbd>space</kbd> flicker by "
      "hand</p>\n</header>\n"
      "<main>\n";
  const ResultsLocation location = location_of(results, output);
  for (const Json* entry : cases) html += case_section(*entry, location, pictures);
  return html + passing(results) + "</main>\n";
}

}  // namespace

fs::path report_file(const fs::path& output) {
  return output / "report.html";
}

void write_report(const Json& results, const fs::path& output) {
  const auto page = [&](std::size_t budget) {
    return render::filled(embedded::report_html(),
                          {{"title", "substep check: " + text_of(results.at("totals"))},
                           {"style", std::string(embedded::report_css())},
                           {"script", std::string(embedded::report_js())},
                           {"body", body(results, output, budget)}});
  };
  const std::size_t size_without_pictures = page(0).size();
  write_file(report_file(output), page(largest_report - std::min(largest_report, size_without_pictures)));
}

}  // namespace substep::golden
