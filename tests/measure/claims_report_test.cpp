// The report of `substep report claims`: what must hold does, and the page shows what is measured, all but
// timings.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "sim/error.h"
#include "sim/measure/claims.h"
#include "tests/folders.h"

namespace substep {
namespace {

/// Returns what `substep report claims` wrote when these tests began (CTest's fixture `claims`).
std::string content(const std::string& name) {
  std::ifstream stream(std::string(test::build_folder) + "/tests/" + name, std::ios::binary);
  EXPECT_TRUE(stream) << name << ": run the tests through ctest, which measures the claims first";
  return {std::istreambuf_iterator<char>(stream), {}};
}

nlohmann::json measured() {
  return nlohmann::json::parse(content("claims.json"));
}

/// Markdown with the digits of its timings taken out.
std::string without_timings(const std::string& markdown) {
  std::string result;
  bool in_timing = false;
  for (const char c : markdown) {
    in_timing = c == '~' || (in_timing && ((c >= '0' && c <= '9') || c == '.'));
    if (!in_timing || c == '~') result += c;
  }
  return result;
}

/// Lines of the tables that the page does not have; it shows them as `substep report claims --format
/// markdown` does.
std::string missing_on_page(const std::string& markdown) {
  std::ifstream stream(std::string(test::source_folder) + "/scenes/claims.md", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const std::string page = without_timings(text);
  std::istringstream lines(without_timings(markdown));
  std::string missing;
  for (std::string line; std::getline(lines, line);) {
    line += '\n';
    if (page.find(line) == std::string::npos) missing += line;
  }
  return missing;
}

class ClaimOfTheReport : public testing::TestWithParam<int> {};

TEST_P(ClaimOfTheReport, HoldsOrIsAFinding) {
  const int number = GetParam();
  const nlohmann::json claim = measured()["claims"].at(number - 1);
  ASSERT_EQ(claim["number"], number);
  EXPECT_FALSE(claim["figures"].empty());
  EXPECT_FALSE(claim["cases"].empty());
  // Findings: at equal time what stands is often better off with iterations (3); a block's smaller gap is not
  // always a smaller error (13); A5's Jacobian in the bias lets joints go (14). What 7 says is decided by
  // timings.
  if (number == 7) return;
  if (number == 3 || number == 13 || number == 14) {
    EXPECT_NE(claim["verdict"], "holds");
  } else {
    EXPECT_EQ(claim["verdict"], "holds");
  }
}

INSTANTIATE_TEST_SUITE_P(All, ClaimOfTheReport, testing::Range(1, 18),
                         [](const auto& number) { return std::to_string(number.param); });

TEST(ClaimsReport, SubstepsBeatIterationsAtEqualRowSolves) {
  const nlohmann::json claim = measured()["claims"].at(2);
  int at_equal_rows = 0;
  for (const nlohmann::json& part : claim["cases"]) {
    if (part["what"].get<std::string>().starts_with("at equal time")) continue;
    EXPECT_TRUE(part["holds"].get<bool>()) << part["what"];
    ++at_equal_rows;
  }
  EXPECT_EQ(at_equal_rows, 14);
}

TEST(ClaimsReport, HoldsTheAblations) {
  const nlohmann::json report = measured();
  ASSERT_EQ(report["claims"].size(), 17u);
  ASSERT_EQ(report["ablation"].size(), 5u);
  for (const nlohmann::json& row : report["ablation"]) {
    EXPECT_EQ(row["costs"]["none (A3)"], 0) << row["scene"];
    // The car turns by little in a step, and its wheels roll alike in both: measured 1.1e-5; on joints 0.03
    // to 4.6.
    EXPECT_GT(row["costs"]["all of A4's"], row["scene"] == "powered_wheel" ? 1e-6 : 1e-2) << row["scene"];
  }
  ASSERT_EQ(report["contact_ablation"].size(), 6u);
  for (const nlohmann::json& column : report["contact_ablation"]) {
    EXPECT_EQ(column["costs"].size(), contact_ablations.size()) << column["scene"];
    const double usual = column["costs"]["none (A5)"];
    EXPECT_GT(usual, 0) << column["scene"];
    if (column["scene"] == "dominoes") {
      EXPECT_GT(column["costs"]["limits by sub-step"], 1.03 * usual);  // measured 1.06
    }
  }
}

TEST(ClaimsReport, MatchesThePage) {
  EXPECT_EQ(missing_on_page(content("claims.md")), "");
}

TEST(ClaimsReport, VerdictNamesCases) {
  Claim claim{1, "I", "one", "two", {}, {}, {{"a", true}, {"b", true}, {"c", false}}};
  EXPECT_EQ(claim.verdict(), "holds except: c");
  claim.cases = {{"a", true}, {"b", false}};
  EXPECT_EQ(claim.verdict(), "holds only: a");
  claim.cases = {{"b", false}};
  EXPECT_EQ(claim.verdict(), "does not hold");
}

TEST(ClaimsReport, NamesMissingScene) {
  try {
    measure_claims("no/such/folder", [](int) {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("rod_chain.gltf"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace substep
