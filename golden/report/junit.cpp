#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "golden/report/failures.h"
#include "golden/report/report.h"
#include "render/markup.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

/// The tests of junit.xml.
struct JunitSuite {
  std::string xml;
  int tests = 0, failures = 0, errors = 0;
  double seconds = 0;

  /// Adds a test. `fault`: "failure", "error", or empty for a test that passes.
  void add(const std::string& attributes, std::string_view fault, const std::string& message = {},
           const std::string& text = {}) {
    ++tests;
    if (fault == "error") ++errors;
    if (fault == "failure") ++failures;
    xml += fmt::format("  <testcase {}", attributes);
    if (!fault.empty()) xml += fmt::format("><{} message=\"{}\"", fault, render::escaped(message));
    if (!text.empty()) xml += fmt::format(">{}</{}></testcase>\n", render::escaped(text), fault);
    if (text.empty()) xml += fault.empty() ? "/>\n" : "/></testcase>\n";
  }

  void add_case(const Json& entry, const ResultsLocation& location) {
    const auto text = [&](const char* key) { return entry.at(key).get<std::string>(); };
    const auto add_half = [&](const char* half, double time, std::string_view fault, const char* message) {
      const std::string attributes =
          fmt::format("classname=\"{}\" name=\"{}\" file=\"{}\" time=\"{:.3f}\"", half,
                      render::escaped(text("name")), render::escaped(text("scene")), time);
      if (fault.empty()) return add(attributes, fault);
      add(attributes, fault, text(message), explanation(entry, location));
    };
    const auto time = entry.at("seconds").get<double>();
    seconds += time;
    if (text("verdict") == "error") return add_half("case", time, "error", "cause");
    const bool passes = text("verdict") == "pass";
    const bool poses_pass = entry.at("poses").at("pass").get<bool>();
    const Json& images = entry.at("images");
    const bool images_pass =
        std::ranges::all_of(images, [](const Json& i) { return i.at("pass").get<bool>(); });
    const bool bad_images = !passes && !images.empty() && (!images_pass || poses_pass);
    // A case that does not pass fails at least one of the two.
    const bool bad_poses = !passes && (!poses_pass || !bad_images);
    // The first test has the case's time, so that the suite's time is the sum over cases.
    add_half("poses", time, bad_poses ? "failure" : "", "meaning");
    if (!images.empty()) add_half("images", 0, bad_images ? "failure" : "", "meaning");
  }

  void add_error(const std::string& why) {
    add("classname=\"check\" name=\"the whole suite\"", "error", why);
  }

  void write(const std::filesystem::path& output) const {
    write_file(junit_file(output),
               fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"substep check\" "
                           "tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\">\n{}</testsuite>\n",
                           tests, failures, errors, seconds, xml));
  }
};

}  // namespace

std::filesystem::path junit_file(const std::filesystem::path& output) {
  return output / "junit.xml";
}

void write_junit(const Json& results, const std::filesystem::path& output) {
  const ResultsLocation location = location_of(results, output);
  JunitSuite suite;
  for (const Json& entry : results.at("cases")) suite.add_case(entry, location);
  for (const std::string file : results.at("orphans")) {
    const std::string name = render::escaped(file);
    suite.add(fmt::format("classname=\"orphans\" name=\"{0}\" file=\"{0}\"", name), "failure",
              file + " belongs to no case");
  }
  if (!results.at("ended").get<bool>()) {
    suite.add_error(fmt::format("the check did not end: {} of {} cases were checked",
                                results.at("cases").size(), results.at("of").get<int>()));
  }
  suite.write(output);
}

void write_failed_junit(const std::string& why, const std::filesystem::path& output) {
  JunitSuite suite;
  suite.add_error(why);
  suite.write(output);
}

}  // namespace substep::golden
