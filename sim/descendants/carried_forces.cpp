#include "sim/descendants/descendants.h"

#include <algorithm>
#include <tuple>

namespace substep {
namespace {

/// Returns the vector with these components along the contact's axes, in the body frame of b.
Vector3 composed(const Contact& contact, const Vector3& along) {
  return contact.normal_b * along[0] + contact.tangent_b1 * along[1] + contact.tangent_b2 * along[2];
}

}  // namespace

Jacobian contact_jacobian(const Contact& contact, const Problem& problem, int k) {
  const Vector3& in_b = k == 0 ? contact.normal_b : k == 1 ? contact.tangent_b1 : contact.tangent_b2;
  const Vector3 direction = problem.rotations[contact.b] * in_b;
  return {direction, contact.arm_a.cross(problem.rotations[contact.a].transpose() * direction),
          in_b.cross(contact.arm_b)};
}

void remember(const std::vector<Contact>& found, const std::vector<CarriedForce>& forces,
              std::vector<ContactMemory>& memory) {
  memory.clear();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Contact& contact = found[i];
    memory.push_back({contact.collider_a, contact.collider_b, contact.arm_a, contact.arm_b,
                      composed(contact, forces[i].displacement), false, 0, composed(contact, forces[i].force),
                      forces[i].stiffness});
  }
  std::ranges::sort(memory, {}, [](const ContactMemory& m) {
    return std::tie(m.collider_a, m.collider_b, m.arm_a[0], m.arm_a[1], m.arm_a[2], m.arm_b[0], m.arm_b[1],
                    m.arm_b[2]);
  });
}

void append_contact_impulses(const std::vector<Contact>& found, const std::vector<CarriedForce>& forces,
                             const std::vector<Coordinates>& q, std::vector<ContactImpulse>& result) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Contact& contact = found[i];
    const Vector3 impulse = q[contact.b].angular * composed(contact, forces[i].impulse);
    result.push_back(
        {contact.a, contact.b, q[contact.a].angular * contact.arm_a + q[contact.a].linear, impulse});
  }
}

}  // namespace substep
