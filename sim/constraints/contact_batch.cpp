#include "sim/constraints/contact_batch.h"

#include <algorithm>
#include <tuple>

#include "sim/constraints/lanes.h"

namespace substep {

bool ContactBatches::Manifold::fits(const Manifold& other) const {
  return std::tie(level, contacts, friction) == std::tie(other.level, other.contacts, other.friction);
}

void ContactBatches::list_manifolds(const Model& model, const std::vector<Contact>& contacts) {
  manifolds_.clear();
  row_count = 0;
  for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
    Manifold manifold{0, 0, 0, 0, static_cast<int>(begin)};
    while (end < contacts.size() && manifold.contacts < most_in_manifold &&
           contacts[end].a == contacts[begin].a && contacts[end].b == contacts[begin].b) {
      const bool has_friction = contacts[end].friction != 0;
      if (has_friction) manifold.friction |= std::uint32_t{1} << manifold.contacts;
      row_count += has_friction ? 3 : 1;
      ++manifold.contacts;
      ++end;
    }
    manifolds_.push_back(manifold);
  }
  if (reading.far_first) {
    measure_distances(model, contacts);
    for (Manifold& manifold : manifolds_) {
      const Contact& contact = contacts[manifold.source];
      manifold.distance = std::min(distance_[contact.a], distance_[contact.b]);
    }
    std::ranges::sort(manifolds_, [](const Manifold& one, const Manifold& other) {
      return std::tie(other.distance, one.source) < std::tie(one.distance, other.source);
    });
  }
  depth_.assign(model.masses.size(), 0);
  for (Manifold& manifold : manifolds_) {
    const Contact& contact = contacts[manifold.source];
    manifold.level = std::max(depth_[contact.a], depth_[contact.b]);
    if (moves(model.masses[contact.a])) depth_[contact.a] = manifold.level + 1;
    if (moves(model.masses[contact.b])) depth_[contact.b] = manifold.level + 1;
  }
}

/// Breadth first from what cannot move, along contacts; what they do not lead to is farthest.
void ContactBatches::measure_distances(const Model& model, const std::vector<Contact>& contacts) {
  const int bodies = static_cast<int>(model.masses.size());
  begin_.assign(bodies + 1, 0);
  partners_.resize(2 * manifolds_.size());
  for (const Manifold& manifold : manifolds_) {
    ++begin_[contacts[manifold.source].a];
    ++begin_[contacts[manifold.source].b];
  }
  for (int body = 1; body <= bodies; ++body) begin_[body] += begin_[body - 1];
  for (const Manifold& manifold : manifolds_) {
    const Contact& contact = contacts[manifold.source];
    partners_[--begin_[contact.a]] = contact.b;
    partners_[--begin_[contact.b]] = contact.a;
  }
  distance_.assign(bodies, bodies);
  reached_.clear();
  for (int body = 0; body < bodies; ++body) {
    if (moves(model.masses[body])) continue;
    distance_[body] = 0;
    reached_.push_back(body);
  }
  for (std::size_t next = 0; next < reached_.size(); ++next) {
    const int body = reached_[next];
    for (int k = begin_[body]; k < begin_[body + 1]; ++k) {
      const int partner = partners_[k];
      if (distance_[partner] < bodies) continue;
      distance_[partner] = distance_[body] + 1;
      reached_.push_back(partner);
    }
  }
}

void ContactBatches::add_batch(const Model& model, const std::vector<Contact>& contacts,
                               const Manifold* first, int count) {
  ContactBatch x{};
  x.contacts = first->contacts;
  x.manifolds = count;
  x.first_normal = static_cast<int>(normals.size());
  x.first_friction = static_cast<int>(frictions.size());
  x.first_coupling = static_cast<int>(couplings.size());
  x.first_restitution = -1;
  for (int lane = 0; lane < lanes; ++lane) {
    const int source = first[lane < count ? lane : 0].source;
    x.source[lane] = source;
    x.a[lane] = contacts[source].a;
    x.b[lane] = contacts[source].b;
    x.inverse_mass_a[lane] = model.masses[x.a[lane]].inverse_mass;
    x.inverse_mass_b[lane] = model.masses[x.b[lane]].inverse_mass;
    for (int i = 0; i < x.contacts; ++i) {
      if (contacts[source + i].restitution > 0) x.first_restitution = static_cast<int>(restitutions.size());
    }
  }
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact = contacts_of(x, i, contacts);
    normals.emplace_back();  // all zero: the limits count from here
    if (x.first_restitution >= 0) {
      restitutions.emplace_back();
      restitutions.back().coefficient = gather(contact, &Contact::restitution);
      restitutions.back().resting_acceleration = gather(contact, &Contact::resting_acceleration);
      restitutions.back().acceleration = gather(contact, &Contact::acceleration);
    }
    if (contact[0]->friction == 0) continue;  // and the others' is, too
    frictions.emplace_back();
    frictions.back().normal = i;
    touching.push_back({gather(contact, &Contact::arm_a), gather(contact, &Contact::arm_b)});
    frictions.back().slid = gather(contact, &Contact::slid);
    frictions.back().reference[0] = gather(contact, &Contact::displacement_1);
    frictions.back().reference[1] = gather(contact, &Contact::displacement_2);
    ++x.frictions;
  }
  couplings.resize(couplings.size() + x.contacts * x.contacts);
  batches.push_back(x);
}

void ContactBatches::build(const Model& model, const std::vector<Contact>& contacts) {
  // There are at most as many manifolds as contacts.
  const std::size_t most = contacts.capacity();
  manifolds_.reserve(most);
  batches.reserve(most);
  normals.reserve(most);
  frictions.reserve(most);
  touching.reserve(most);
  restitutions.reserve(most);
  couplings.reserve(8 * most);
  partners_.reserve(2 * most);
  place_of_.reserve(most);
  in_order_.reserve(most);
  begin_.reserve(most + 1);
  reached_.reserve(model.masses.size());
  batches.clear();
  normals.clear();
  frictions.clear();
  touching.clear();
  restitutions.clear();
  couplings.clear();
  formulations = 0;
  list_manifolds(model, contacts);
  std::ranges::sort(manifolds_, [](const Manifold& one, const Manifold& other) {
    return std::tie(one.level, one.contacts, one.friction, one.source) <
           std::tie(other.level, other.contacts, other.friction, other.source);
  });
  for (std::size_t begin = 0, end = 0; begin < manifolds_.size(); begin = end) {
    for (end = begin + 1; end < manifolds_.size() && end - begin < lanes; ++end) {
      if (!manifolds_[end].fits(manifolds_[begin])) break;
    }
    add_batch(model, contacts, &manifolds_[begin], static_cast<int>(end - begin));
  }
}

}  // namespace substep
