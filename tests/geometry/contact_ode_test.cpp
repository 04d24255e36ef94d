#include <gtest/gtest.h>
#include <ode/ode.h>

#include <array>
#include <cmath>

#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

struct OdeAnswer {
  int count = 0;
  double depth = 0;
};

OdeAnswer ask_ode(const Vector3& size_a, const Pose& pose_a, const Vector3& size_b, const Pose& pose_b) {
  struct Placed {
    dVector3 position;
    dMatrix3 rotation;
    dVector3 size;
  };
  const auto placed = [](const Vector3& size, const Pose& pose) {
    Placed result = {};
    const Matrix3 rotation = pose.orientation.toRotationMatrix();
    for (int row = 0; row < 3; ++row) {
      result.position[row] = pose.position[row];
      result.size[row] = size[row];
      for (int column = 0; column < 3; ++column) result.rotation[4 * row + column] = rotation(row, column);
    }
    return result;
  };
  const Placed a = placed(size_a, pose_a);
  const Placed b = placed(size_b, pose_b);
  dVector3 normal = {};
  dReal depth = 0;
  int axis = 0;
  std::array<dContactGeom, 16> points = {};
  OdeAnswer answer;
  answer.count = dBoxBox(a.position, a.rotation, a.size, b.position, b.rotation, b.size, normal, &depth,
                         &axis, 16, points.data(), sizeof(dContactGeom));
  answer.depth = depth;
  return answer;
}

TEST(ContactsAgainstOde, RandomBoxesOverlapAlikeAndAsDeep) {
  std::mt19937 random(1);
  int overlapping = 0;
  int apart = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Vector3 size_a = test::random_point(random, 0.9).cwiseAbs() + Vector3::Constant(0.1);
    const Vector3 size_b = test::random_point(random, 0.9).cwiseAbs() + Vector3::Constant(0.1);
    const Pose pose_a = {test::random_point(random, 0.8), test::random_orientation(random)};
    const Pose pose_b = {Vector3::Zero(), test::random_orientation(random)};
    const OdeAnswer ode = ask_ode(size_a, pose_a, size_b, pose_b);
    const Polytope a = box(size_a);
    const Polytope b = box(size_b);
    const auto points = test::contacts(a, pose_a, b, pose_b, 1e-6);
    ASSERT_EQ(test::complaint(points, 1e-6), "");
    const double size = 2 * std::min(a.bounding_radius, b.bounding_radius);
    if (ode.count == 0) {
      ++apart;
      // A face may be preferred to the edges that show the gap.
      if (!points.empty()) {
        EXPECT_GT(test::lowest_distance(points), -1.2e-3 * size) << trial;
      }
      continue;
    }
    ++overlapping;
    ASSERT_FALSE(points.empty()) << trial;
    // Both prefer faces: ODE by 5 % of the depth, we by 5 % and a thousandth of the size.
    const double depth = -test::lowest_distance(points);
    EXPECT_NEAR(depth, ode.depth, 0.06 * ode.depth + 1.2e-3 * size) << trial;
  }
  EXPECT_GT(overlapping, 5000);
  EXPECT_GT(apart, 5000);
}

TEST(ContactsAgainstOde, StackedBoxesHaveAsManyContacts) {
  std::mt19937 random(2);
  const Vector3 size(1, 1, 1);
  const Polytope cube = box(size);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vector3 shift = test::random_point(random, 0.4);
    const Pose top = {{shift.x(), 1 - 1e-3, shift.z()}, test::turn(shift.y() * 4, {0, 1, 0})};
    const OdeAnswer ode = ask_ode(size, top, size, {});
    const auto points = test::contacts(cube, top, cube, {}, 1e-6);
    EXPECT_EQ(points.size(), static_cast<std::size_t>(ode.count)) << trial;
    EXPECT_NEAR(-test::lowest_distance(points), ode.depth, 1e-14);
  }
}

}  // namespace
}  // namespace substep
