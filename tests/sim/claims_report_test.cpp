// The report of `substep claims`: what must hold does, and all but timings is the same in every run.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "sim/error.h"
#include "sim/measure/claims.h"

namespace substep {
namespace {

ClaimsReport measured() {
  return measure_claims(std::string(SUBSTEP_SOURCE_DIR) + "/scenes", [](int) {});
}

/// A verdict that a timing decides, and timings, taken out.
nlohmann::json without_timings(nlohmann::json report) {
  for (nlohmann::json& claim : report["claims"]) {
    bool decided_by_timing = false;
    for (nlohmann::json& figure : claim["figures"]) {
      if (figure["timing"]) figure.erase("values");
    }
    for (nlohmann::json& part : claim["cases"]) {
      if (!part["timing"]) continue;
      part.erase("holds");
      decided_by_timing = true;
    }
    if (decided_by_timing) claim.erase("verdict");
  }
  return report;
}

/// Markdown with the digits of its timings taken out.
std::string without_timings(const std::string& markdown) {
  return std::regex_replace(markdown, std::regex("~[0-9.]+"), "~");
}

/// Lines of the tables that README does not have; it shows them as `substep claims --format markdown` does.
std::string missing_in_readme(const std::string& markdown) {
  std::ifstream stream(std::string(SUBSTEP_SOURCE_DIR) + "/README.md", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const std::string readme = without_timings(text);
  std::istringstream lines(without_timings(markdown));
  std::string missing;
  for (std::string line; std::getline(lines, line);) {
    line += '\n';
    if (readme.find(line) == std::string::npos) missing += line;
  }
  return missing;
}

TEST(ClaimsReport, HoldsWhereItMustAsReadmeSaysAndTheSameTwice) {
  const ClaimsReport report = measured();
  ASSERT_EQ(report.claims.size(), 14u);
  std::map<int, std::string> verdicts;
  for (const Claim& claim : report.claims) {
    verdicts[claim.number] = claim.verdict();
    EXPECT_FALSE(claim.figures.empty()) << claim.number;
    EXPECT_FALSE(claim.cases.empty()) << claim.number;
  }
  for (const int number : {1, 2, 4, 5, 6, 8, 9, 10, 11, 12}) EXPECT_EQ(verdicts[number], "holds") << number;
  // Findings. A block's smaller gap is not always a smaller error; A5's Jacobian in the bias lets joints go.
  EXPECT_EQ(verdicts[3], "holds");
  EXPECT_NE(verdicts[13], "holds");
  EXPECT_NE(verdicts[14], "holds");

  EXPECT_EQ(missing_in_readme(to_markdown(report)), "");

  const nlohmann::json first = nlohmann::json::parse(to_json(report));
  ASSERT_EQ(first["claims"].size(), 14u);
  ASSERT_EQ(first["ladder"].size(), report.ladder.size());
  for (const LadderPrices& row : report.ladder) {
    EXPECT_EQ(row.prices.front(), 0) << row.scene;  // A3 itself
    EXPECT_GT(row.prices.back(), 1e-3) << row.scene;
  }
  ASSERT_EQ(first["contact_ladder"].size(), 6u);
  for (const nlohmann::json& column : first["contact_ladder"]) {
    EXPECT_EQ(column["prices"].size(), contact_rungs.size()) << column["scene"];
    EXPECT_GT(column["prices"]["all six (A5)"], 0) << column["scene"];
  }
  EXPECT_EQ(without_timings(first), without_timings(nlohmann::json::parse(to_json(measured()))));
}

TEST(ClaimsReport, VerdictSaysForWhat) {
  Claim claim{1, "I", "one", "two", {}, {{"a", true}, {"b", true}, {"c", false}}};
  EXPECT_EQ(claim.verdict(), "holds except: c");
  claim.cases = {{"a", true}, {"b", false}};
  EXPECT_EQ(claim.verdict(), "holds only: a");
  claim.cases = {{"b", false}};
  EXPECT_EQ(claim.verdict(), "does not hold");
}

TEST(ClaimsReport, AMissingSceneIsNamed) {
  try {
    measure_claims("no/such/folder", [](int) {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("rod_chain.gltf"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace substep
