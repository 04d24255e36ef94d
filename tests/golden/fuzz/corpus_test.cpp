/// Replays the corpus: each file, as it is and after random changes, is read or refused by an Error.

#include <gtest/gtest.h>

#include <set>

#include "tests/fuzz_corpus.h"
#include "tests/golden/fuzz/golden_fuzzer.h"

namespace substep::golden {
namespace {

constexpr const char* corpus_folder = "tests/golden/fuzz/corpus";

TEST(GoldenFuzzCorpus, ReadsEveryKindOfFile) {
  std::set<std::string> kinds_read;
  for (const std::string& content : test::corpus(corpus_folder))
    if (reads_or_refuses(content)) kinds_read.insert(content.substr(0, content.find('\n')));
  EXPECT_EQ(kinds_read.size(), 6u);
}

TEST(GoldenFuzzCorpus, ReadsOrRefusesChangedFiles) {
  std::mt19937 random(1);
  int refused = 0;
  for (const std::string& content : test::corpus(corpus_folder)) {
    const std::size_t body = content.find('\n') + 1;
    for (int i = 0; i < 300; ++i) refused += !reads_or_refuses(test::changed(content, body, random));
  }
  EXPECT_GE(refused, 500);  // else the changes change nothing
}

}  // namespace
}  // namespace substep::golden
