// Tests the output of `substep report claims`: the claims that must hold do, and the page has each measured
// line except timings and the verdict that depends on them.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <regex>
#include <sstream>

#include "sim/log/file_output.h"
#include "sim/measure/claims.h"
#include "tests/error_message.h"
#include "tests/folders.h"

namespace substep {
namespace {

/// Returns the text that `substep report claims` wrote before these tests (CTest's fixture `claims`).
std::string measured() {
  const std::string file = std::string(test::build_folder) + "/tests/claims.md";
  EXPECT_TRUE(content_of(file)) << file << ": run the tests through ctest, which measures the claims first";
  return content_of(file).value_or("");
}

/// Returns the verdict of a claim: "holds", "holds except: …".
std::string verdict_of(int number) {
  const std::string text = measured();
  const std::size_t line = text.find(fmt::format("Claim {} (", number));
  const std::size_t begin = text.find("**It ", line) + 5;
  EXPECT_TRUE(line < begin && begin < text.find('\n', line)) << number;
  return text.substr(begin, text.find(".**", begin) - begin);
}

/// Returns the text without the digits of its timings, which follow a ~.
std::string without_timings(const std::string& markdown) {
  return std::regex_replace(markdown, std::regex("~[0-9.]+"), "~");
}

class ClaimOfTheReport : public testing::TestWithParam<int> {};

TEST_P(ClaimOfTheReport, HoldsExceptForFindings) {
  const int number = GetParam();
  const std::string verdict = verdict_of(number);
  // Findings: a block's smaller gap is not always a smaller error (13); A5's Jacobian in the bias lets joints
  // open (14). Timings decide claim 7, but for its first case.
  const std::regex allowed(number == 7                    ? "holds( only: the same row solves| except: A.*)?"
                           : number == 13 || number == 14 ? "holds except: .*"
                                                          : "holds");
  EXPECT_TRUE(std::regex_match(verdict, allowed)) << verdict;
}

INSTANTIATE_TEST_SUITE_P(All, ClaimOfTheReport, testing::Range(1, 19),
                         [](const auto& number) { return std::to_string(number.param); });

TEST(ClaimsReport, PageHasEachLine) {
  const std::string page =
      without_timings(*content_of(std::string(test::source_folder) + "/scenes/claims.md"));
  std::istringstream lines(without_timings(measured()));
  for (std::string line; std::getline(lines, line);)
    EXPECT_TRUE(line.starts_with("Claim 7 (") || page.find(line + '\n') != std::string::npos) << line;
}

TEST(ClaimsReport, VerdictNamesCases) {
  Claim claim{1, "I", "one", "two", {}};
  claim.require("b", false);
  EXPECT_EQ(claim.verdict(), "does not hold");
  claim.require("a", true);
  EXPECT_EQ(claim.verdict(), "holds only: a");
  claim.require("c", true);
  EXPECT_EQ(claim.verdict(), "holds except: b");
}

TEST(ClaimsReport, NamesMissingScene) {
  const std::string message = test::message_of([] { measure_claims("no/such/folder", [](double) {}); });
  EXPECT_NE(message.find("rod_chain.gltf"), std::string::npos) << message;
}

}  // namespace
}  // namespace substep
