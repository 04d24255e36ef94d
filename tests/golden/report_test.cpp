#include "golden/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "golden/check/check_results.h"
#include "render/markup.h"
#include "render/renderer.h"
#include "sim/error.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

class ReportTest : public testing::Test {
 protected:
  ReportTest() : suite_("bouncing_balls", 40) { suite_.make_goldens(); }

  /// Both changed: another light, and one ball bounces otherwise.
  void break_both() {
    replace_in(suite_.scene(), "\"intensity\":3.0", "\"intensity\":2.5");
    replace_in(suite_.scene(), "\"restitution\":0.5", "\"restitution\":0.4");
  }

  std::string page() const { return read_text(report_file(suite_.options.output)); }

  SmallSuite suite_;
};

TEST_F(ReportTest, IsSelfContained) {
  break_both();
  EXPECT_EQ(suite_.run().cases.at(0).verdict, Verdict::scene_changed);
  const std::string html = page();
  EXPECT_EQ(html.find("http://"), std::string::npos);
  EXPECT_EQ(html.find("https://"), std::string::npos);
  EXPECT_EQ(html.find("{{"), std::string::npos);
  EXPECT_NE(html.find("id=\"bouncing_balls.a3\""), std::string::npos);
  EXPECT_NE(html.find("the renderer’s part"), std::string::npos);
  EXPECT_NE(html.find("the simulation’s part"), std::string::npos);
  EXPECT_NE(html.find("substep approve bouncing_balls.a3"), std::string::npos);
  EXPECT_LT(html.size(), largest_report);
  // Every picture is in the page.
  EXPECT_EQ(html.find("src=\"bouncing_balls.a3"), std::string::npos);
}

TEST_F(ReportTest, ShowsOtherProvenance) {
  auto sidecar = nlohmann::ordered_json::parse(read_text(suite_.sidecar()));
  sidecar["made_with"]["compiler"] = "gcc 99";
  write_text(suite_.sidecar(), sidecar_text(sidecar));
  break_both();
  suite_.run();
  EXPECT_THAT(page(), testing::HasSubstr("note     golden made with compiler gcc 99, here "));
}

TEST_F(ReportTest, RepeatsByteByByte) {
  break_both();
  suite_.run();
  const auto without_times = [&](const char* file) {
    std::string text = read_text(suite_.options.output / file);
    for (const std::string_view start : {"time=\"", "\"seconds\": "}) {
      for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at)) {
        at += start.size();
        text.erase(at, text.find_first_not_of("0123456789.", at) - at);
      }
    }
    return text;
  };
  const std::string html = page();
  const std::string json = without_times("results.json");
  const std::string xml = without_times("junit.xml");
  suite_.run();
  EXPECT_EQ(page(), html);
  EXPECT_EQ(without_times("results.json"), json);
  EXPECT_EQ(without_times("junit.xml"), xml);
}

TEST_F(ReportTest, LinksPlayerOfChangedMotion) {
  break_both();
  suite_.run();
  EXPECT_NE(page().find("href=\"bouncing_balls.a3/player.html#t="), std::string::npos);
  const std::string player = read_text(suite_.shown("player.html"));
  EXPECT_NE(player.find("as it runs now"), std::string::npos);
  EXPECT_NE(player.find("the golden run"), std::string::npos);
}

TEST_F(ReportTest, OmitsPlayerOfUnchangedMotion) {
  replace_in(suite_.scene(), "\"intensity\":3.0", "\"intensity\":2.5");
  suite_.run();
  EXPECT_EQ(page().find("player.html"), std::string::npos);
  EXPECT_FALSE(fs::exists(suite_.shown("player.html")));
}

TEST_F(ReportTest, StaysBelowTenMegabytes) {
  break_both();
  suite_.run();
  auto results = read_results(suite_.options.output);
  const auto entry = results.at("cases").at(0);
  for (const int count : {177, 1000}) {
    results["cases"].clear();
    for (int i = 0; i < count; ++i) {
      results["cases"].push_back(entry);
      results["cases"].back()["name"] = fmt::format("case_{}.a3", i);
      // Let as many cases differ in a suite: the report's words grow with the cases.
      results["cases"].back()["cause"] = fmt::format("from frame {} on", i);
    }
    write_report(results, suite_.options.output);
    const std::string html = page();
    EXPECT_LE(html.size(), largest_report) << count;
    EXPECT_GT(html.size(), largest_report / 2) << count;
    // The first picture is within the first 200 kB, which is what a browser has when it first draws.
    const std::size_t first = html.find("src=\"data:image/png;base64,");
    EXPECT_LT(first, 200'000U) << count;
    // The page has all pictures of the first case.
    const std::size_t section = html.find("<section class=\"case\"");
    EXPECT_EQ(
        html.substr(section, html.find("</section>", section) - section).find("src=\"bouncing_balls.a3"),
        std::string::npos);
    // The last is there, too, to be approved.
    EXPECT_NE(html.find(fmt::format("substep approve case_{}.a3 ", count - 1)), std::string::npos);
  }
}

TEST_F(ReportTest, GroupsOneChangeOfManyScenes) {
  replace_in(suite_.scene(), "\"intensity\":3.0", "\"intensity\":2.5");
  suite_.run();
  auto results = read_results(suite_.options.output);
  const auto entry = results.at("cases").at(0);
  const auto add = [&](const std::string& scene, const std::string& cause) {
    results["cases"].push_back(entry);
    results["cases"].back()["scene"] = scene;
    results["cases"].back()["cause"] = cause;
  };
  for (int i = 0; i < 9; ++i) add(fmt::format("{}.gltf", i), "placement or strength of light");
  add("heavy.gltf", "mass or inertia of a; placement or strength of camera, light");
  add("one.gltf", "gone: d");
  std::string lines;
  for (const FailureGroup& group : failure_groups(results)) lines += group.line() + "\n";
  EXPECT_EQ(
      lines,
      "10 cases, scene changed: placement or strength of light, 10 of 12 cases, of 10 scenes, all a3; "
      "simplest: "
      "bouncing_balls.a3\n"
      "bouncing_balls.a3, scene changed: gone: d\n"
      "bouncing_balls.a3, scene changed: mass or inertia of a; placement or strength of camera, light\n");
}

TEST_F(ReportTest, GroupsFailuresOfOneAlgorithm) {
  suite_.run();
  auto results = read_results(suite_.options.output);
  auto entry = results.at("cases").at(0);
  results["cases"].clear();
  for (const char* algorithm : {"a2", "a3", "a3"}) {
    entry["settings"]["algorithm"] = algorithm;
    entry["verdict"] = algorithm == std::string("a3") ? "simulation changed" : "pass";
    results["cases"].push_back(entry);
  }
  const std::vector<FailureGroup> groups = failure_groups(results);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_THAT(groups[0].line(),
              testing::StartsWith("2 cases, simulation changed: all cases of a3, no others"));
}

TEST_F(ReportTest, JunitNamesTheFailingHalf) {
  replace_in(suite_.scene(), "\"intensity\":3.0", "\"intensity\":2.5");
  suite_.run();
  const std::string xml = read_text(junit_file(suite_.options.output));
  EXPECT_NE(xml.find("tests=\"2\" failures=\"1\""), std::string::npos) << xml;
  const std::string test = " name=\"bouncing_balls.a3\" file=\"[^\"]*bouncing_balls.gltf\" time=\"[0-9.]+\"";
  EXPECT_THAT(xml, testing::ContainsRegex("classname=\"poses\"" + test + "/>"));
  EXPECT_THAT(xml, testing::ContainsRegex("classname=\"images\"" + test + "><failure"));
}

TEST(Markup, Escapes) {
  EXPECT_EQ(render::escaped("a<b & \"c\"\x01"), "a&lt;b &amp; &quot;c&quot; ");
}

}  // namespace
}  // namespace substep::golden
