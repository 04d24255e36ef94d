#include "golden/report/report_assets.h"

#include "render/embedded_file.h"

SUBSTEP_EMBEDDED_FILE(report_page, SUBSTEP_REPORT "/report.html")
SUBSTEP_EMBEDDED_FILE(report_style, SUBSTEP_REPORT "/report.css")
SUBSTEP_EMBEDDED_FILE(report_script, SUBSTEP_REPORT "/report.js")

namespace substep::golden::report_assets {

std::string_view page() {
  return report_page();
}
std::string_view style() {
  return report_style();
}
std::string_view script() {
  return report_script();
}

}  // namespace substep::golden::report_assets
