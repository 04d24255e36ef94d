// Base64, hashes, and the settings that follow a scene.

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

#include "sim/math/base64.h"
#include "sim/math/fnv1a.h"
#include "sim/model/settings.h"
#include "sim/model/usual_settings.h"

namespace substep {
namespace {

// RFC 4648's test values, and both digits that are neither letters nor numbers.
TEST(Base64, MatchesRfc4648) {
  const std::pair<std::string, std::string> pairs[] = {{"", ""},
                                                       {"f", "Zg=="},
                                                       {"fo", "Zm8="},
                                                       {"foo", "Zm9v"},
                                                       {"foob", "Zm9vYg=="},
                                                       {"foobar", "Zm9vYmFy"},
                                                       {"\xfb\xff", "+/8="}};
  for (const auto& [bytes, text] : pairs) {
    EXPECT_EQ(base64(bytes), text);
    std::optional<char> stranger;
    EXPECT_EQ(base64_decoded(text, stranger), bytes);
    EXPECT_FALSE(stranger) << text;
  }
}

TEST(Base64, NamesInvalidByte) {
  std::optional<char> stranger;
  base64_decoded("Zm9v Zm9v", stranger);
  EXPECT_EQ(stranger, ' ');
}

// Fowler, Noll and Vo's own test values.
TEST(Fnv1a, MatchesPublishedValues) {
  EXPECT_EQ(fnv1a(""), 0xcbf29ce484222325);
  EXPECT_EQ(fnv1a("a"), 0xaf63dc4c8601ec8c);
  EXPECT_EQ(fnv1a("foobar"), 0x85944171f73967e8);
}

TEST(Fnv1a, IsContinued) {
  EXPECT_EQ(fnv1a("bar", fnv1a("foo")), fnv1a("foobar"));
  // The lowest byte is the first: 'f', 'o', 'o'.
  EXPECT_EQ(fnv1a_of_number(0x6f6f66, 3, fnv1a_start), fnv1a("foo"));
  EXPECT_EQ(fnv1a_of_number(0xff, 1, fnv1a_start), fnv1a("\xff"));
}

TEST(Settings, FollowScene) {
  Scene scene;
  EXPECT_EQ(usual_settings(scene, Algorithm::a5).substeps, default_settings(Algorithm::a5).substeps);
  scene.step = 0.02;
  scene.substeps = 45;
  const Settings a2 = usual_settings(scene, Algorithm::a2);
  EXPECT_EQ(a2.step, 0.02);
  EXPECT_EQ(a2.iterations, 45);
  const Settings a3 = usual_settings(scene, Algorithm::a3);
  EXPECT_EQ(a3.substeps, 45);
  EXPECT_EQ(a3.iterations, 1);
}

}  // namespace
}  // namespace substep
