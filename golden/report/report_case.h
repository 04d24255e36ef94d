#pragma once
/// A failing case in the report (report.h), from its part of results.json.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "golden/report/case_commands.h"

namespace substep::golden {

/// Pictures as part of the page, or as links where it would grow too large.
class ReportPictures {
 public:
  ReportPictures(std::filesystem::path output, std::size_t budget)
      : output_(std::move(output)), budget_(budget) {}

  std::string source(const std::filesystem::path& folder, const std::string& file);

 private:
  std::filesystem::path output_;
  std::size_t budget_;
};

std::string case_section(const nlohmann::ordered_json& entry, const ResultsLocation& location,
                         ReportPictures& pictures);

/// Returns a JSON string as text of the page.
std::string text_of(const nlohmann::ordered_json& json);

/// Returns a verdict as a class of the style sheet.
std::string css_class(std::string verdict);

}  // namespace substep::golden
