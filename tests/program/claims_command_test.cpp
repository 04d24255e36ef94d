#include <gtest/gtest.h>

#include <string>

#include "program.h"
#include "tests/folders.h"

namespace substep {
namespace {

class ClaimsCommand : public Program {
 protected:
  static std::string scenes() { return std::string(test::source_folder) + "/scenes"; }
};

TEST_F(ClaimsCommand, WhatCannotBeUsedIsRefused) {
  expect_refused({"report", "claims", "--scenes", "nowhere"}, "nowhere");
  expect_refused({"report", "claims", "--scenes", scenes(), "--output", "nowhere/claims.md"}, "nowhere");
}

}  // namespace
}  // namespace substep
