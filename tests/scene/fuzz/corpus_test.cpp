/// Replays the corpus of the fuzzer: every file loads or is refused, also after a few random changes.

#include <gtest/gtest.h>

#include "tests/fuzz_corpus.h"
#include "tests/scene/fuzz/scene_fuzzer.h"

namespace substep {
namespace {

constexpr const char* corpus_folder = "tests/scene/fuzz/corpus";

TEST(FuzzCorpus, LoadsOrRefusesEveryFile) {
  const std::vector<std::string> corpus = test::corpus(corpus_folder);
  int loaded = 0;
  for (const std::string& content : corpus) loaded += loads_or_is_refused(content);
  EXPECT_GE(corpus.size(), 300u);  // measured 307
  EXPECT_GE(loaded, 5);            // a loader that refuses everything fails here
}

TEST(FuzzCorpus, LoadsOrRefusesChangedFiles) {
  std::mt19937 random(20261121);
  int loaded = 0;
  for (const std::string& content : test::corpus(corpus_folder)) {
    if (content.starts_with("mesh.")) continue;  // a process each
    for (int i = 0; i < 40; ++i) loaded += loads_or_is_refused(test::changed(content, 0, random));
  }
  EXPECT_GE(loaded, 40);
}

}  // namespace
}  // namespace substep
