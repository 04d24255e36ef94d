#include "render/report/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/embedded_file.h"
#include "render/report/bad_figures.h"
#include "render/report/report_tables.h"
#include "sim/study/advice.h"
#include "sim/study/sweep_results.h"

SUBSTEP_EMBEDDED_FILE(report_template, SUBSTEP_REPORT_PAGE "/report.md")

namespace substep {
namespace {

/// By the figures' names; without those that the sweep has nothing for.
using Pictures = std::map<std::string, std::string>;

Pictures drawn(const FigureSource& source, const std::function<void(double)>& progress) {
  Pictures pictures;
  for (const ReportFigure& figure : figures()) {
    if (progress) progress(static_cast<double>(pictures.size()) / static_cast<double>(figures().size()));
    const Sheet sheet = figure.make(source);
    // A sweep need not have what each figure shows.
    if (!sheet.panels.empty()) pictures[figure.name] = draw(sheet, PictureFormat::svg);
  }
  return pictures;
}

/// Parts between empty lines, their lines joined.
std::vector<std::string> parts_of(std::string_view text) {
  std::vector<std::string> parts(1);
  while (!text.empty()) {
    const std::size_t length = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, length);
    text.remove_prefix(std::min(text.size(), length + 1));
    if (line.empty()) {
      if (!parts.back().empty()) parts.emplace_back();
    } else {
      parts.back() += fmt::format("{}{}", parts.back().empty() ? "" : " ", line);
    }
  }
  if (parts.back().empty()) parts.pop_back();
  return parts;
}

/// Fills in report.md: paragraphs with figures in braces, ![figures] and [what is made of the records].
class Report {
 public:
  Report(const FigureSource& source, Pictures pictures)
      : source_(source), records_(source.records), pictures_(std::move(pictures)) {}

  Document page() {
    for (const std::string& part : parts_of(report_template())) {
      if (part.starts_with('#')) {
        const std::size_t level = part.find(' ');
        is_left_out_ = false;
        section_ = page_.blocks.size();
        page_.heading(static_cast<int>(level), part.substr(level + 1));
      } else if (is_left_out_) {
        continue;
      } else if (part.starts_with("![")) {
        picture(part.substr(2, part.size() - 3));
      } else if (part.starts_with('[')) {
        contents_.at(part.substr(1, part.size() - 2))();
      } else {
        page_.paragraph(filled(part));
      }
    }
    return std::move(page_);
  }

 private:
  void picture(const std::string& name) {
    if (!pictures_.contains(name)) return;
    page_.picture(figure_named(name).about, fmt::format("figures/{}.svg", name), pictures_.at(name));
  }

  std::string filled(const std::string& paragraph) const {
    const std::vector<std::string>& lost = equal_rows_.failing;
    return fmt::format(
        fmt::runtime(paragraph), fmt::arg("runs", records_.size()),
        fmt::arg("scenes", scenes_of(records_).size()), fmt::arg("orders", order_ranges(orders_)),
        fmt::arg("won", equal_rows_.holding.size()),
        fmt::arg("compared", equal_rows_.holding.size() + lost.size()),
        fmt::arg("won_scenes", fmt::join(equal_rows_.holding, ", ")),
        fmt::arg("lost_scenes", lost.empty() ? "" : fmt::format(" Not on {}.", fmt::join(lost, ", "))),
        fmt::arg("contact_ablation", contact_ablation_caption(source_.contact_ablation)));
  }

  void slopes() {
    for (const std::string& scene : scenes_of(records_)) {
      const std::vector<SweepRecord> own = of_scene(records_, scene);
      if (has_contacts(own)) continue;
      page_.heading(4, scene);
      page_.table(slopes_table(own));
    }
  }

  void advice_for_scenes() {
    for (const std::string& scene : scenes_of(records_)) {
      const std::vector<SweepRecord> own = of_scene(records_, scene);
      page_.heading(3, scene);
      page_.paragraph(advice(own));
      page_.paragraph("The runs that no other one beats in error and in cost:");
      page_.table(runs_table(best_runs(own)));
    }
  }

  /// Without rows it goes, with its section.
  void table_if_any(const TextTable& table) {
    is_left_out_ = table.rows.empty();
    if (is_left_out_) {
      page_.blocks.resize(section_);
    } else {
      page_.table(table);
    }
  }

  const FigureSource& source_;
  const std::vector<SweepRecord>& records_;
  const Pictures pictures_;
  const TextTable orders_ = orders_table(records_);
  const EqualRows equal_rows_ = equal_rows(records_);
  Document page_;
  std::size_t section_ = 0;  ///< where in the page the last heading of the template is
  bool is_left_out_ = false;
  /// What stands in brackets in the template.
  const std::map<std::string, std::function<void()>> contents_{
      {"worst figures", [this] { add_bad_figures(records_, page_); }},
      {"choices", [this] { page_.table(choices_table(records_)); }},
      {"orders", [this] { page_.table(orders_); }},
      {"slopes of each scene", [this] { slopes(); }},
      {"equal rows", [this] { page_.table(equal_rows_.table); }},
      {"limits", [this] { page_.table(limits_table(records_, false)); }},
      {"limits with contacts", [this] { page_.table(limits_table(records_, true)); }},
      {"ablation of contacts", [this] { page_.table(contact_ablation_table(source_.contact_ablation)); }},
      {"advice for each scene", [this] { advice_for_scenes(); }},
      {"references", [this] { page_.table(references_table(records_)); }},
      {"other engines, if any", [this] { table_if_any(engines_table(records_)); }},
      {"omitted, if any", [this] { table_if_any(omitted_table(records_)); }},
  };
};

}  // namespace

Document report_page(const FigureSource& source, const std::map<std::string, std::string>& pictures) {
  return Report(source, pictures).page();
}

Document make_report(const FigureSource& given, const std::function<void(double)>& progress) {
  FigureSource source = given;
  // Once for its figure and its table.
  if (source.contact_ablation.empty()) source.contact_ablation = contact_ablation(source.scenes);
  return report_page(source, drawn(source, progress));
}

}  // namespace substep
