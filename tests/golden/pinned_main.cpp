// Of the tests that draw: by the pinned renderer, whatever the surroundings ask for.

#include <gtest/gtest.h>

#include "render/renderer.h"

int main(int argc, char** argv) {
  substep::render::pin_renderer();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
