#include "golden/report/junit.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "render/markup.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

using Json = nlohmann::ordered_json;

bool poses_pass(const Json& entry) {
  const Json& poses = entry.at("poses");
  return !poses.at("checked").get<bool>() || poses.at("pass").get<bool>();
}

bool images_pass(const Json& entry) {
  const Json& images = entry.at("images");
  return std::all_of(images.begin(), images.end(),
                     [](const Json& image) { return image.at("pass").get<bool>(); });
}

std::string test(const Json& entry, const char* half, bool passes) {
  std::string xml = fmt::format("  <testcase classname=\"{}\" name=\"{}\"", half,
                                escaped(entry.at("name").get<std::string>()));
  if (passes) return xml + "/>\n";
  const auto text = entry.value("text", std::string());
  return xml + fmt::format("><failure message=\"{}\">{}</failure></testcase>\n",
                           escaped(entry.at("meaning").get<std::string>()), escaped(text));
}

}  // namespace

std::filesystem::path junit_file(const std::filesystem::path& output) {
  return output / "junit.xml";
}

void write_junit(const Json& results, const std::filesystem::path& output) {
  std::string tests;
  int count = 0;
  int failures = 0;
  const auto add = [&](const std::string& xml, bool passes) {
    tests += xml;
    ++count;
    failures += passes ? 0 : 1;
  };
  for (const Json& entry : results.at("cases")) {
    const bool passes = entry.at("verdict") == "pass";
    if (entry.at("poses").at("checked").get<bool>()) {
      const bool good = passes || poses_pass(entry);
      add(test(entry, "poses", good), good);
    }
    if (!entry.at("images").empty()) {
      // Whatever fails, at least one of the two says so.
      const bool good = passes || (images_pass(entry) && !poses_pass(entry));
      add(test(entry, "images", good), good);
    }
  }
  for (const Json& orphan : results.at("orphans")) {
    add(fmt::format(
            "  <testcase classname=\"orphans\" name=\"{0}\"><failure message=\"{0} belongs to no case\"/>"
            "</testcase>\n",
            escaped(orphan.get<std::string>())),
        false);
  }
  write_file(junit_file(output),
             fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"substep check\" "
                         "tests=\"{}\" failures=\"{}\">\n{}</testsuite>\n",
                         count, failures, tests));
}

}  // namespace substep
