#include "sim/math/fnv1a.h"

#include <gtest/gtest.h>

namespace substep {
namespace {

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

}  // namespace
}  // namespace substep
