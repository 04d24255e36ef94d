#include "render/picture_areas.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "render/camera.h"
#include "test_scenes.h"

namespace substep::render {
namespace {

constexpr int width = 250;  // no whole number of tiles
constexpr int height = 135;

/// Returns how many of the rectangles cover each pixel, row by row from below.
std::vector<int> coverage(const std::vector<Rectangle>& areas) {
  std::vector<int> covered(std::size_t{width} * height, 0);
  for (const Rectangle& area : areas) {
    for (int y = area.y; y < std::min(area.y + area.height, height); ++y) {
      for (int x = area.x; x < std::min(area.x + area.width, width); ++x) ++covered[y * width + x];
    }
  }
  return covered;
}

TEST(PictureAreas, CoverVisibleBodiesOnce) {
  const Scene scene = three_shapes();
  std::vector<Coordinates> poses = start_of(scene);
  Renderer renderer(scene, {.width = width, .height = height});
  const BodyMesh mesh = gather_body_mesh(scene);
  const glm::dmat4 clip = clip_from_world(renderer.view(), 0.01, 1000);
  const auto covered_area = [&] {
    const std::vector<int> covered = coverage(areas_of(mesh.parts, poses, clip, width, height));
    const Image bodies = renderer.draw_bodies(poses);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const bool is_body = bodies.pixel(x, height - 1 - y)[0] > 1;
        EXPECT_TRUE(covered[y * width + x] == 1 || (covered[y * width + x] == 0 && !is_body))
            << x << ' ' << y;
      }
    }
    return std::ranges::count(covered, 1);
  };
  EXPECT_LT(covered_area(), width * height / 3);
  // Move a body half out of the picture, then behind the eye.
  poses[1].linear += Vector3(renderer.view().right.x, renderer.view().right.y, renderer.view().right.z) * 2;
  covered_area();
  poses[1].linear = Vector3(renderer.view().eye.x, renderer.view().eye.y, renderer.view().eye.z);
  EXPECT_EQ(covered_area(), width * height);
}

TEST(SeenAreas, HoldAllSamplesOfBodies) {
  // Take 2 × 2 samples in a pixel, and a box at (16, 32) that tiles do not divide.
  const Rectangle box{16, 32, 21, 13};
  std::vector<float> depths(std::size_t{42} * 26, 1.0F);
  EXPECT_TRUE(seen_areas(depths, box, 2).empty());
  depths[25 * 42 + 41] = 0.5F;  // the last sample
  const std::vector<Rectangle> one = seen_areas(depths, box, 2);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].x, 36);
  EXPECT_EQ(one[0].y, 44);
  std::ranges::fill(depths, 0.5F);
  const std::vector<Rectangle> all = seen_areas(depths, box, 2);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].width, 24);
  EXPECT_EQ(all[0].height, 16);
}

TEST(MovesBy, DetectsHundredthOfAPixel) {
  // A metre is a hundred pixels, 2 m in front of the eye.
  glm::dmat4 clip(1);
  clip[2] = {0, 0, -1, -1};
  clip[3] = {0, 0, 0, 0};
  Part part;
  part.body = 1;
  part.low = {-1, -0.5, -0.5};
  part.high = {1, 0.5, 0.5};
  const std::vector<Coordinates> from{{}, {{0, 0, -2.5}, Quaternion::Identity()}};
  const auto moves = [&](double pixels, const Vector3& shift, double turn) {
    std::vector<Coordinates> to = from;
    to[1].linear += shift;
    to[1].angular = rotation_quaternion({0, 0, turn});
    return moves_by(pixels, std::span(&part, 1), from, to, clip, 400, 400);
  };
  EXPECT_FALSE(moves(1e-9, {0, 0, 0}, 0));
  EXPECT_TRUE(moves(0.0099, {1e-4, 0, 0}, 0));
  EXPECT_FALSE(moves(0.0101, {1e-4, 0, 0}, 0));
  // A corner of the near side is 1.118 m from the axis.
  EXPECT_TRUE(moves(0.011, {0, 0, 0}, 1e-4));
  EXPECT_FALSE(moves(0.0113, {0, 0, 0}, 1e-4));
  EXPECT_TRUE(moves(1e6, {0, 0, 2}, 0));  // behind the eye
}

TEST(GroundAreas, KeepMarkedCellsOutOfOpenAreas) {
  // Look down at a slant from 2 m above the ground, with the horizon in the picture, on a map of 8 × 8 cells
  // of a metre.
  const glm::dvec3 eye(4, 2, 12);
  const glm::dvec3 corner(-0.9, -0.75, -1);
  const glm::dvec3 right(1.8 / width, 0, 0);
  const glm::dvec3 up(0, 0.9 / height, 0);
  const glm::dmat3 to_map(glm::dvec3(0.125, 0, 0), glm::dvec3(0, 0.125, 0), glm::dvec3(0, 0, 1));
  const auto is_marked = [](std::size_t cell) { return cell == 20 || cell == 43; };
  const MarkedCells some(8, to_map, is_marked);
  const MarkedCells none(8, to_map, [](std::size_t) { return false; });
  for (const bool is_first : {true, false}) {
    const GroundAreas areas = ground_areas(eye, 2, corner, right, up, width, height, is_first ? some : none,
                                           is_first ? none : some);
    EXPECT_EQ(areas.occluded.empty(), is_first);
    const std::vector<int> open = coverage(areas.open);
    const std::vector<int> shadowed = coverage(areas.shadowed);
    const std::vector<int> occluded = coverage(areas.occluded);
    int marked = 0;
    for (int i = 0; i < width * height; ++i) {
      EXPECT_EQ(open[i] + shadowed[i] + occluded[i], 1);
      const glm::dvec3 ray = corner + right * (i % width + 0.5) + up * (i / width + 0.5);
      const glm::dvec3 hit = eye + ray * (-2 / ray.y);
      const bool is_on_map = ray.y < 0 && hit.x >= 0 && hit.x < 8 && hit.z >= 0 && hit.z < 8;
      if (!is_on_map || !is_marked(static_cast<std::size_t>(hit.z) * 8 + static_cast<std::size_t>(hit.x)))
        continue;
      ++marked;
      EXPECT_EQ(open[i], 0) << i;
    }
    EXPECT_GT(marked, 100);
    EXPECT_GT(std::ranges::count(open, 1), width * height / 2);
  }
}

}  // namespace
}  // namespace substep::render
