/// Replays the corpus: every file is read, and after a few random changes read or refused.

#include <gtest/gtest.h>

#include "tests/fuzz_corpus.h"
#include "tests/golden/fuzz/golden_fuzzer.h"

namespace substep::golden {
namespace {

constexpr const char* corpus_folder = "tests/golden/fuzz/corpus";

TEST(GoldenFuzzCorpus, ReadsOrRefusesEveryFile) {
  int read = 0;
  for (const std::string& content : test::corpus(corpus_folder)) read += reads_or_refuses(content);
  EXPECT_GE(read, 6);  // one of each kind at least
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
