#pragma once
/// The report's page, style and script: the files in golden/report/, as they were when the program was built.

#include <string_view>

namespace substep::golden::report_assets {

std::string_view page();
std::string_view style();
std::string_view script();

}  // namespace substep::golden::report_assets
