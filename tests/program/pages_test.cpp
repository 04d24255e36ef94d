// The tables on the scenes' pages are what the program prints.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "program.h"

namespace substep {
namespace {

constexpr std::string_view begins = "<!-- measured: substep ";

std::vector<std::string> pages() {
  std::vector<std::string> names;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(SUBSTEP_SOURCE_DIR) / "scenes")) {
    if (entry.path().extension() == ".gltf") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

class EachPage : public testing::TestWithParam<std::string> {};

TEST_P(EachPage, HoldsWhatTheProgramPrints) {
  std::ifstream file(std::filesystem::path(SUBSTEP_SOURCE_DIR) / "scenes" / (GetParam() + ".md"));
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  const std::size_t start = page.find(begins);
  ASSERT_NE(start, std::string::npos) << "no table";
  const std::size_t words = start + begins.size();
  const std::size_t text = page.find(" -->\n", words);
  const std::size_t end = page.find("<!-- end -->", text);
  ASSERT_NE(end, std::string::npos);
  const std::string command = quoted(SUBSTEP_PROGRAM) + " " + page.substr(words, text - words);
  const Outcome outcome = run_command("cd " + quoted(SUBSTEP_SOURCE_DIR) + " && " + command);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, page.substr(text + 5, end - text - 5));
}

INSTANTIATE_TEST_SUITE_P(Pages, EachPage, testing::ValuesIn(pages()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace substep
