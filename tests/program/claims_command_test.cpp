#include <gtest/gtest.h>

#include <string>

#include "program.h"

namespace substep {
namespace {

class ClaimsCommand : public Program {
 protected:
  static std::string scenes() { return std::string(SUBSTEP_SOURCE_DIR) + "/scenes"; }
};

TEST_F(ClaimsCommand, WhatCannotBeUsedIsRefused) {
  expect_refused({"report", "claims", "--scenes", scenes(), "--format", "html"}, "--format 'html'");
  expect_refused({"report", "claims", "--scenes", "nowhere"}, "nowhere");
  expect_refused({"report", "claims", "--scenes", scenes(), "--output", "nowhere/claims.md"}, "nowhere");
  expect_refused({"report", "claims", "--scenes", scenes(), "--output", "claims.html"}, ".txt, .md or .json");
}

}  // namespace
}  // namespace substep
