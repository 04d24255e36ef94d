#include "sim/geometry/round_solids.h"

#include <cmath>

#include "sim/error.h"

namespace substep {
namespace {

bool are_radii(double bottom, double top) {
  return bottom >= 0 && top >= 0 && bottom + top > 0 && std::isfinite(bottom + top);
}

}  // namespace

Cylinder make_cylinder(double height, double radius_bottom, double radius_top) {
  if (!(height > 0) || !std::isfinite(height) || !are_radii(radius_bottom, radius_top)) {
    throw Error("a cylinder needs a positive height and radii that are not both 0");
  }
  return {height / 2, radius_bottom, radius_top};
}

TaperedCapsule make_tapered_capsule(double height, double radius_bottom, double radius_top) {
  if (!(height >= 0) || !std::isfinite(height) || !are_radii(radius_bottom, radius_top)) {
    throw Error("a tapered capsule needs a height that is not negative and radii that are not both 0");
  }
  return {height / 2, radius_bottom, radius_top};
}

}  // namespace substep
