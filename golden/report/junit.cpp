#include "golden/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "golden/report/case_commands.h"
#include "render/markup.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

using Json = nlohmann::ordered_json;

bool images_pass(const Json& entry) {
  const Json& images = entry.at("images");
  return std::all_of(images.begin(), images.end(),
                     [](const Json& image) { return image.at("pass").get<bool>(); });
}

class Suite {
 public:
  void add_case(const Json& entry, const ResultsLocation& location) {
    const bool passes = entry.at("verdict") == "pass";
    if (entry.at("verdict") == "error") {
      return add("case", entry, "error", entry.at("cause").get<std::string>(), explanation(entry, location));
    }
    const bool poses_pass = entry.at("poses").at("pass").get<bool>();
    const bool has_images = !entry.at("images").empty();
    const bool bad_images = !passes && has_images && (!images_pass(entry) || poses_pass);
    // A case that does not pass fails at least one of the two.
    const bool bad_poses = !passes && (!poses_pass || !bad_images);
    const auto add_half = [&](const char* half, bool is_bad) {
      if (!is_bad) return add(half, entry, nullptr, {}, {});
      add(half, entry, "failure", entry.at("meaning").get<std::string>(), explanation(entry, location));
    };
    add_half("poses", bad_poses);
    if (has_images) add_half("images", bad_images);
  }

  void add_error(const std::string& name, const std::string& why) {
    ++tests_;
    ++errors_;
    xml_ += fmt::format("  <testcase classname=\"check\" name=\"{}\"><error message=\"{}\"/></testcase>\n",
                        render::escaped(name), render::escaped(why));
  }

  void add_orphan(const std::string& file) {
    ++tests_;
    ++failures_;
    xml_ += fmt::format(
        "  <testcase classname=\"orphans\" name=\"{0}\" file=\"{0}\"><failure message=\"{0} belongs to no "
        "case\"/></testcase>\n",
        render::escaped(file));
  }

  void write(const std::filesystem::path& output) const {
    write_file(junit_file(output),
               fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"substep check\" "
                           "tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\">\n{}</testsuite>\n",
                           tests_, failures_, errors_, seconds_, xml_));
  }

 private:
  /// `what` is null for a test that passes.
  void add(const char* half, const Json& entry, const char* what, const std::string& message,
           const std::string& text) {
    ++tests_;
    // A case's time is its first test's: the sum is what the check took.
    const bool is_first = entry.at("name") != last_name_;
    last_name_ = entry.at("name");
    const double seconds = is_first ? entry.at("seconds").get<double>() : 0;
    seconds_ += seconds;
    xml_ += fmt::format("  <testcase classname=\"{}\" name=\"{}\" file=\"{}\" time=\"{:.3f}\"", half,
                        render::escaped(last_name_), render::escaped(entry.at("scene").get<std::string>()),
                        seconds);
    if (what == nullptr) {
      xml_ += "/>\n";
      return;
    }
    (std::string_view(what) == "error" ? errors_ : failures_) += 1;
    xml_ += fmt::format("><{0} message=\"{1}\">{2}</{0}></testcase>\n", what, render::escaped(message),
                        render::escaped(text));
  }

  std::string xml_;
  std::string last_name_;
  int tests_ = 0;
  int failures_ = 0;
  int errors_ = 0;
  double seconds_ = 0;
};

}  // namespace

std::filesystem::path junit_file(const std::filesystem::path& output) {
  return output / "junit.xml";
}

void write_junit(const Json& results, const std::filesystem::path& output) {
  const ResultsLocation location = location_of(results, output);
  Suite suite;
  for (const Json& entry : results.at("cases")) suite.add_case(entry, location);
  for (const Json& orphan : results.at("orphans")) suite.add_orphan(orphan.get<std::string>());
  if (!results.at("ended").get<bool>()) {
    suite.add_error("the whole suite", fmt::format("the check did not end: {} of {} cases were checked",
                                                   results.at("cases").size(), results.at("of").get<int>()));
  }
  suite.write(output);
}

void write_failed_junit(const std::string& why, const std::filesystem::path& output) {
  Suite suite;
  suite.add_error("the whole suite", why);
  suite.write(output);
}

}  // namespace substep::golden
