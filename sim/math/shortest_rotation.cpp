#include "sim/math/rotation.h"

namespace substep {

Quaternion shortest_rotation(const Vector3& from, const Vector3& to) {
  return Quaternion::FromTwoVectors(from, to);
}

}  // namespace substep
