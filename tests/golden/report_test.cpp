#include "golden/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>

#include "render/markup.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

using testing::HasSubstr;

class ReportTest : public testing::Test {
 protected:
  ReportTest() : suite_("bouncing_balls", 40) { suite_.make_goldens(); }

  /// Changes both the light and the restitution of one ball.
  void break_both() {
    suite_.change_light();
    replace_in(suite_.scene(), "\"restitution\":0.5", "\"restitution\":0.4");
  }

  std::string page() const { return suite_.result_text("report.html"); }

  SmallSuite suite_;
};

TEST_F(ReportTest, IsSelfContained) {
  break_both();
  EXPECT_EQ(suite_.run().verdict, Verdict::scene_changed);
  const std::string html = page();
  for (const char* const part : {"id=\"bouncing_balls.a3\"", "golden picture, then golden poses drawn now",
                                 "changed by the simulation", "substep approve bouncing_balls.a3"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  // Every picture is in the page.
  for (const char* const part : {"http://", "https://", "{{", "src=\"bouncing_balls.a3"})
    EXPECT_EQ(html.find(part), std::string::npos) << part;
  EXPECT_LT(html.size(), largest_report);
}

TEST_F(ReportTest, ShowsOtherProvenance) {
  suite_.change_sidecar([](auto& json) { json["made_with"]["compiler"] = "gcc 99"; });
  break_both();
  suite_.run();
  EXPECT_THAT(page(), HasSubstr("note     golden made with compiler gcc 99, here "));
}

TEST_F(ReportTest, RepeatsByteByByte) {
  break_both();
  suite_.run();
  const auto without_times = [&](const char* file) {
    return std::regex_replace(suite_.result_text(file), std::regex("(time=\"|\"seconds\": )[0-9.]+"), "$1");
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
  EXPECT_THAT(page(), HasSubstr("href=\"bouncing_balls.a3/player.html#t="));
  const std::string player = read_text(suite_.shown("player.html"));
  EXPECT_THAT(player, HasSubstr("as it runs now"));
  EXPECT_THAT(player, HasSubstr("the golden run"));
  EXPECT_THAT(player, testing::Not(HasSubstr("\"uncertainty\":[]")));
  // Another light alone has no player, nor has another step.
  replace_in(suite_.scene(), "\"restitution\":0.4", "\"restitution\":0.5");
  suite_.run();
  EXPECT_THAT(page(), testing::Not(HasSubstr("player.html")));
  EXPECT_FALSE(std::filesystem::exists(suite_.shown("player.html")));
  suite_.add_to_suite("settings = { step = 0.01 }");
  EXPECT_THAT(suite_.run().notes, testing::Contains("no motion page: the golden run has another step"));
  EXPECT_FALSE(std::filesystem::exists(suite_.shown("player.html")));
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
    EXPECT_GT(html.find("src=\"bouncing_balls.a3", section), html.find("</section>", section));
    // The last is there, too, to be approved.
    EXPECT_NE(html.find(fmt::format("substep approve case_{}.a3 ", count - 1)), std::string::npos);
  }
}

TEST_F(ReportTest, GroupsOneChangeOfManyScenes) {
  suite_.change_light();
  suite_.run();
  auto results = read_results(suite_.options.output);
  const auto entry = results.at("cases").at(0);
  const auto add = [&](const std::string& scene, const std::string& cause) {
    results["cases"].push_back(entry);
    results["cases"].back()["scene"] = scene;
    results["cases"].back()["cause"] = cause;
  };
  for (int i = 0; i < 9; ++i)
    add(fmt::format("{}.gltf", i), "pose, field of view, brightness or colour of light");
  add("heavy.gltf",
      "mass, inertia or gravity factor of a; pose, field of view, brightness or colour of camera, light");
  add("one.gltf", "gone: d");
  std::string lines;
  for (const FailureGroup& group : failure_groups(results)) lines += group.line() + "\n";
  EXPECT_EQ(lines,
            "10 cases, scene changed: pose, field of view, brightness or colour of light, 10 of 12 cases, in "
            "10 scenes, by a3; simplest: bouncing_balls.a3\n"
            "bouncing_balls.a3, scene changed: gone: d\n"
            "bouncing_balls.a3, scene changed: mass, inertia or gravity factor of a; pose, field of view, "
            "brightness or colour of camera, light\n");
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
  EXPECT_THAT(groups[0].line(), testing::StartsWith("2 cases, simulation changed: all cases of a3"));
}

TEST_F(ReportTest, JunitNamesTheFailingHalf) {
  suite_.change_light();
  suite_.run();
  const std::string xml = suite_.result_text("junit.xml");
  EXPECT_THAT(xml, HasSubstr("tests=\"2\" failures=\"1\""));
  const std::string test = " name=\"bouncing_balls.a3\" file=\"[^\"]*bouncing_balls.gltf\" time=\"[0-9.]+\"";
  EXPECT_THAT(xml, testing::ContainsRegex("classname=\"poses\"" + test + "/>"));
  EXPECT_THAT(xml, testing::ContainsRegex("classname=\"images\"" + test + "><failure"));
}

TEST(Markup, Escapes) {
  EXPECT_EQ(render::escaped("a<b & \"c\"\x01"), "a&lt;b &amp; &quot;c&quot; ");
  EXPECT_EQ(render::escaped("a\xff"), "a\xef\xbf\xbd");
}

}  // namespace
}  // namespace substep::golden
