// The report of `substep report claims`: what must hold does, and the page shows what is measured, all but
// timings.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "sim/measure/claims.h"
#include "tests/error_message.h"
#include "tests/folders.h"

namespace substep {
namespace {

/// Returns what `substep report claims` wrote when these tests began (CTest's fixture `claims`).
std::string measured() {
  std::ifstream stream(std::string(test::build_folder) + "/tests/claims.md", std::ios::binary);
  EXPECT_TRUE(stream) << "run the tests through ctest, which measures the claims first";
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the verdict of a claim: "holds", "holds except: …".
std::string verdict_of(int number) {
  const std::string text = measured();
  const std::size_t line = text.find(fmt::format("Claim {} (", number));
  const std::size_t begin = text.find("**It ", line) + 5;
  EXPECT_LT(begin, text.find('\n', line)) << number;
  return text.substr(begin, text.find(".**", begin) - begin);
}

/// Returns the numbers of the row of a table that begins with `name`; what is no number counts as 0.
std::vector<double> row_of(const std::string& name) {
  const std::string text = measured();
  const std::size_t begin = text.find(fmt::format("| {} |", name));
  EXPECT_NE(begin, std::string::npos) << name;
  std::istringstream cells(
      text.substr(begin + name.size() + 4, text.find('\n', begin) - begin - name.size() - 4));
  std::vector<double> numbers;
  for (std::string cell; std::getline(cells, cell, '|');)
    numbers.push_back(std::strtod(cell.c_str(), nullptr));
  return numbers;
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

/// Lines of the tables that the page does not have.
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
  const std::string verdict = verdict_of(number);
  // Findings: at equal time what stands is often better off with iterations (3); a block's smaller gap is not
  // always a smaller error (13); A5's Jacobian in the bias lets joints go (14). What 7 says is decided by
  // timings.
  if (number == 7) return;
  if (number == 3 || number == 13 || number == 14) {
    EXPECT_TRUE(verdict.starts_with("holds except: ")) << verdict;
  } else {
    EXPECT_EQ(verdict, "holds");
  }
}

INSTANTIATE_TEST_SUITE_P(All, ClaimOfTheReport, testing::Range(1, 18),
                         [](const auto& number) { return std::to_string(number.param); });

TEST(ClaimsReport, SubstepsBeatIterationsAtEqualRowSolves) {
  // At equal time they do not always.
  std::istringstream failing(verdict_of(3).substr(14));
  for (std::string part; std::getline(failing >> std::ws, part, ';');) {
    EXPECT_TRUE(part.starts_with("at equal time")) << part;
  }
}

TEST(ClaimsReport, HoldsTheAblations) {
  EXPECT_EQ(row_of("none (A3)"), std::vector<double>(5, 0));
  // The car turns by little in a step, and its wheels roll alike in both: measured 1.1e-5; on joints 0.03 to
  // 4.6.
  const std::vector<double> all = row_of("all of A4's");
  ASSERT_EQ(all.size(), 5U);
  EXPECT_GT(*std::ranges::min_element(all.begin(), all.begin() + 4), 1e-2);
  EXPECT_GT(all[4], 1e-6);
}

TEST(ClaimsReport, MatchesThePage) {
  EXPECT_EQ(missing_on_page(measured()), "");
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
  const std::string message = test::message_of([] { measure_claims("no/such/folder", [](int) {}); });
  EXPECT_NE(message.find("rod_chain.gltf"), std::string::npos) << message;
}

}  // namespace
}  // namespace substep
