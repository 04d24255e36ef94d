#include "sim/math/base64.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

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

}  // namespace
}  // namespace substep
