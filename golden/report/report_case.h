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

/// Returns verdict, cause and command alone, for a page that would grow too large.
std::string brief_section(const nlohmann::ordered_json& entry, const ResultsLocation& location);

/// Returns a JSON string as text of the page.
std::string text_of(const nlohmann::ordered_json& json);

/// Returns a verdict as a class of the style sheet.
std::string css_class(std::string verdict);

/// Returns an SVG of the largest shift in the picture (pixels) and the largest error of position (m), on
/// logarithmic axes, with three markers: first difference, half a pixel (predicted), first visible (drawn).
/// `poses` is that of a case in results.json. Empty when there is nothing to draw.
std::string error_strip(const nlohmann::ordered_json& poses);

}  // namespace substep::golden
