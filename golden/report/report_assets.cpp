#include "golden/report/report_assets.h"

// Part of the program, so that a report needs no files.
asm(".section .rodata\n"
    "substep_report_page:\n"
    ".incbin \"" SUBSTEP_REPORT
    "/report.html\"\n"
    "substep_report_page_end:\n"
    "substep_report_style:\n"
    ".incbin \"" SUBSTEP_REPORT
    "/report.css\"\n"
    "substep_report_style_end:\n"
    "substep_report_script:\n"
    ".incbin \"" SUBSTEP_REPORT
    "/report.js\"\n"
    "substep_report_script_end:\n"
    "substep_review_script:\n"
    ".incbin \"" SUBSTEP_REPORT
    "/review.js\"\n"
    "substep_review_script_end:\n"
    ".previous\n");
extern "C" const char substep_report_page[];
extern "C" const char substep_report_page_end[];
extern "C" const char substep_report_style[];
extern "C" const char substep_report_style_end[];
extern "C" const char substep_report_script[];
extern "C" const char substep_report_script_end[];
extern "C" const char substep_review_script[];
extern "C" const char substep_review_script_end[];

namespace substep::report_assets {

std::string_view page() {
  return {substep_report_page, substep_report_page_end};
}
std::string_view style() {
  return {substep_report_style, substep_report_style_end};
}
std::string_view script() {
  return {substep_report_script, substep_report_script_end};
}

std::string_view review_script() {
  return {substep_review_script, substep_review_script_end};
}

}  // namespace substep::report_assets
