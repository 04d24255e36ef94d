// Main function of tests that draw, which use the pinned renderer in any environment.

#include <gtest/gtest.h>

#include "render/renderer.h"

int main(int argc, char** argv) {
  substep::render::pin_renderer();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
