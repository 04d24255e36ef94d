// Compares the files of A1 to A5 with the report's listings: each line of a listing is marked once, in order,
// and A3 and A4 differ only in the report's three lines.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "sim/log/file_output.h"
#include "tests/folders.h"

namespace {

/// Returns a file of the folder sim; nothing where there is none.
std::string read(const std::string& file) {
  return substep::content_of(std::string(substep::test::source_folder) + "/sim/" + file).value_or("");
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Returns the numbers of the marks "// procK:N", in the file's order.
std::vector<int> marks(const std::string& text, int procedure) {
  std::vector<int> found;
  for (const std::string& line : lines_of(text)) {
    int of = 0;
    int number = 0;
    const std::size_t mark = line.find("// proc");
    if (mark == std::string::npos || std::sscanf(line.c_str() + mark, "// proc%d:%d", &of, &number) != 2)
      continue;
    EXPECT_EQ(of, procedure) << line;
    found.push_back(number);
  }
  return found;
}

struct Listing {
  const char* file;
  int procedure;
  std::vector<int> statements;  // the listing's lines that do something; the others are headings
};

const std::vector<Listing> listings{
    {"a1_direct.cpp", 1, {3, 4, 5, 7, 8}},
    {"a2_psor.cpp", 2, {3, 5, 6, 7, 8, 9, 10, 12, 13}},
    {"a3_substep.cpp", 3, {4, 5, 7, 8, 9, 10, 11, 12, 13, 15, 17, 18, 19}},
    {"a4_approximate.cpp", 4, {4, 5, 7, 8, 9, 10, 11, 12, 13, 15, 16, 18, 19, 20}},
    {"a5_havok.cpp", 5, {5, 6, 8, 9, 10, 11, 12, 13, 15, 16, 17, 19, 20, 21}},
};

TEST(Listings, EachStatementIsMarkedOnceAndInOrder) {
  for (const Listing& listing : listings) {
    const std::string text = read(listing.file);
    ASSERT_FALSE(text.empty()) << listing.file;
    EXPECT_EQ(marks(text, listing.procedure), listing.statements) << listing.file;
  }
}

/// Returns the file's lines after the procedure's name, without comments and empty lines.
std::vector<std::string> statements(const std::string& file) {
  std::vector<std::string> body;
  bool inside = false;
  for (std::string line : lines_of(read(file))) {
    line.erase(std::min(line.find("//"), line.size()));
    line.erase(line.find_last_not_of(" \t") + 1);
    if (line.find("void proc") == 0) {
      inside = true;
      continue;
    }
    if (inside && !line.empty()) body.push_back(line);
  }
  return body;
}

TEST(Listings, A3AndA4DifferInThreeLines) {
  const std::vector<std::string> a3 = statements("a3_substep.cpp");
  const std::vector<std::string> a4 = statements("a4_approximate.cpp");
  ASSERT_GT(a3.size(), 20u);
  std::vector<std::string> only_a3, shared_a3;
  std::vector<std::string> only_a4, shared_a4;
  for (const std::string& line : a3)
    (std::ranges::find(a4, line) == a4.end() ? only_a3 : shared_a3).push_back(line);
  for (const std::string& line : a4)
    (std::ranges::find(a3, line) == a3.end() ? only_a4 : shared_a4).push_back(line);
  EXPECT_EQ(shared_a3, shared_a4);
  // Lines 15 and 16 of A4: J̆ʲ⁺¹ ≈ J̆ʲ and βʲ⁺¹ = βʲ − J̆ʲv̆ʲ for J̆, β from exact coordinates. Line 20: the
  // rotation.
  ASSERT_EQ(only_a3.size(), 3u);
  EXPECT_NE(only_a3[0].find("step_coordinates"), std::string::npos);
  EXPECT_NE(only_a3[1].find("formulate"), std::string::npos);
  EXPECT_NE(only_a3[2].find("q[i].angular ="), std::string::npos);
  ASSERT_EQ(only_a4.size(), 3u);
  EXPECT_NE(only_a4[0].find("substeps.offset"), std::string::npos);
  EXPECT_NE(only_a4[1].find("update_biases"), std::string::npos);
  EXPECT_NE(only_a4[2].find("q[i].angular ="), std::string::npos);
}

TEST(Listings, SubstepLoopsAreInTheListingsOnly) {
  for (const Listing& listing : listings) {
    const std::string text = read(listing.file);
    const bool sub_stepped = listing.procedure >= 3;
    EXPECT_EQ(text.find("for (int j = 1; j <= n; ++j)") != std::string::npos, sub_stepped) << listing.file;
    EXPECT_EQ(text.find("for (int i = 1; i <= m; ++i)") != std::string::npos, sub_stepped) << listing.file;
  }
  EXPECT_NE(read("a2_psor.cpp").find("for (int p = 0; p < cap"), std::string::npos);
  // Shared code in sim/constraints has no loop over sub-steps or iterations, and none that solves all blocks
  // or batches: loops over them formulate or update.
  int files = 0;
  int loops = 0;
  const std::filesystem::path folder =
      std::filesystem::path(substep::test::source_folder) / "sim/constraints";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string text = read("constraints/" + entry.path().filename().string());
    ASSERT_FALSE(text.empty()) << entry.path();
    ++files;
    for (const char* const end :
         {" <= n; ", " <= m; ", " <= substeps; ", " <= iterations; ", ".substeps; ", ".iterations; "}) {
      EXPECT_EQ(text.find(end), std::string::npos) << entry.path() << ": a loop that ends at" << end;
    }
    for (const char* const range : {"c.blocks) ", "batches) "}) {
      for (std::size_t at = text.find(range); at != std::string::npos; at = text.find(range, at + 1)) {
        ++loops;
        const std::string body = text.substr(at, text.find("\n\n", at) - at);
        for (const char* const solving : {"solve(", "solve_relaxed(", "solve_and_apply(", "apply("})
          EXPECT_EQ(body.find(solving), std::string::npos) << entry.path() << ": " << body;
      }
    }
  }
  EXPECT_GE(files, 10);
  EXPECT_GE(loops, 15);
}

}  // namespace
