#include "sim/constraints/contact_batch.h"

#include <algorithm>
#include <tuple>

#include "sim/constraints/contact_patch.h"

namespace substep {
namespace {

constexpr int rows_of_patch = 6;

/// Returns true where forces move the body and turn it about all axes, which makes a patch's Γ regular.
bool moves_freely(const BodyMass& mass) {
  return mass.inverse_mass > 0 && mass.inverse_inertia.minCoeff() > 0;
}

/// Returns true where a manifold's points have the same directions in all formulations of the step.
bool have_one_direction(const Contact* first, int count) {
  return std::all_of(first + 1, first + count, [&](const Contact& other) {
    return other.normal_b == first->normal_b && other.tangent_b1 == first->tangent_b1 &&
           other.tangent_b2 == first->tangent_b2 && other.turns_with_a == first->turns_with_a &&
           other.turns_with_neither == first->turns_with_neither;
  });
}

}  // namespace

bool ContactBatches::Manifold::fits(const Manifold& other) const {
  if ((corners > 0) != (other.corners > 0)) return false;
  if (corners > 0) return true;
  // One contact alone is solved at once, several by sweeps.
  const bool are_several = contacts > 1 && other.contacts > 1;
  if (are_several && has_friction && other.has_friction) return true;
  return contacts == other.contacts && has_friction == other.has_friction;
}

bool ContactBatches::Manifold::is_shorter(const Manifold& other) const {
  return std::tie(corners, contacts) < std::tie(other.corners, other.contacts);
}

void ContactBatches::list_manifolds(const Model& model, const std::vector<Contact>& contacts,
                                    const std::vector<Coordinates>& q) {
  manifolds_.clear();
  row_count = 0;
  const auto add_patch = [&](Manifold manifold, int shape) {
    manifold.corners = shapes[shape].corners;
    manifold.shape = shape;
    row_count += rows_of_patch;
    manifolds_.push_back(manifold);
  };
  // Add the kept patches
  for (int i = 0; i < static_cast<int>(shapes.size()); ++i) {
    const PatchShape& shape = shapes[i];
    add_patch({.a = shape.a, .b = shape.b, .colliders = std::minmax(shape.collider_a, shape.collider_b)}, i);
  }
  // Cut the contacts into manifolds, and make a patch of a manifold where possible
  for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
    const Contact& contact = contacts[begin];
    const bool has_friction = contact.friction != 0;
    Manifold manifold{.has_friction = has_friction,
                      .source = static_cast<int>(begin),
                      .a = contact.a,
                      .b = contact.b,
                      .colliders = std::minmax(contact.collider_a, contact.collider_b)};
    while (end < contacts.size() && manifold.contacts < most_in_manifold && contacts[end].a == contact.a &&
           contacts[end].b == contact.b && (contacts[end].friction != 0) == has_friction) {
      ++manifold.contacts;
      ++end;
    }
    const bool is_regular = moves_freely(model.masses[contact.a]) || moves_freely(model.masses[contact.b]);
    if (!q.empty() && manifold.contacts > 1 && is_regular &&
        have_one_direction(&contact, manifold.contacts)) {
      const auto shape = patch_shape(&contact, manifold.contacts, q[contact.a], q[contact.b]);
      if (shape) {
        shapes.push_back(*shape);
        add_patch(manifold, static_cast<int>(shapes.size()) - 1);
        continue;
      }
    }
    row_count += (has_friction ? 3 : 1) * manifold.contacts;
    manifolds_.push_back(manifold);
  }
  // Sort by distance, far ones first
  measure_distances(model);
  for (Manifold& manifold : manifolds_) {
    manifold.distance = std::min(distance_[manifold.a], distance_[manifold.b]);
  }
  std::ranges::sort(manifolds_, [](const Manifold& one, const Manifold& other) {
    return std::tie(other.distance, one.colliders, one.source) <
           std::tie(one.distance, other.colliders, other.source);
  });
}

/// Measures each body's distance from fixed bodies in the graph of contacts, breadth first. Bodies that no
/// contact leads to are farthest.
void ContactBatches::measure_distances(const Model& model) {
  const int bodies = static_cast<int>(model.masses.size());
  begin_.assign(bodies + 1, 0);
  partners_.resize(2 * manifolds_.size());
  for (const Manifold& manifold : manifolds_) {
    ++begin_[manifold.a];
    ++begin_[manifold.b];
  }
  for (int body = 1; body <= bodies; ++body) begin_[body] += begin_[body - 1];
  for (const Manifold& manifold : manifolds_) {
    partners_[--begin_[manifold.a]] = manifold.b;
    partners_[--begin_[manifold.b]] = manifold.a;
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

/// Adds a batch. Its rows are set when they are formulated.
void ContactBatches::add_batch(const Model& model, const std::vector<Contact>& contacts,
                               const Manifold* first, int count) {
  const Manifold& longest = first[count - 1];
  ContactBatch x{};
  x.contacts = longest.corners > 0 ? 0 : longest.contacts;
  x.has_friction = longest.has_friction;
  x.manifolds = count;
  x.patch = longest.corners > 0 ? counts_.patches++ : -1;
  x.corners = longest.corners;
  x.first_point = counts_.points;
  x.first_coupling = counts_.couplings;
  x.first_corner = counts_.corners;
  counts_.points += x.contacts;
  counts_.couplings += x.contacts * x.contacts;
  counts_.corners += x.corners;
  for (int lane = 0; lane < lanes; ++lane) {
    const Manifold& manifold = first[lane < count ? lane : 0];
    x.source[lane] = manifold.source;
    x.shape[lane] = manifold.shape;
    x.count[lane] = manifold.contacts;
    x.a[lane] = manifold.a;
    x.b[lane] = manifold.b;
    const BodyMass& a = model.masses[x.a[lane]];
    const BodyMass& b = model.masses[x.b[lane]];
    x.inverse_mass_a[lane] = a.inverse_mass;
    x.inverse_mass_b[lane] = b.inverse_mass;
    for (int k = 0; k < 3; ++k) {
      x.inverse_inertia_a[k][lane] = a.inverse_inertia[k];
      x.inverse_inertia_b[k][lane] = b.inverse_inertia[k];
    }
    for (int i = 0; i < manifold.contacts && manifold.corners == 0; ++i) {
      if (contacts[manifold.source + i].restitution != Contact::no_impact) x.has_impacts = true;
    }
  }
  batches.push_back(x);
}

/// Adds the batches of manifolds at one distance. They are cut into four runs (fewer where a run would have
/// less than two manifolds), in the order of the file, and a batch takes the next of each run, so that
/// neighbours, which share a body, follow each other. The third and fourth run go opposite to the first two:
/// a sweep goes from the ends of a row of boxes to its middle, and at the next distance from the middle to
/// the ends. No side of the row is always first, so a pyramid of 465 boxes moves by 21 mm; if all runs go
/// forwards, it moves by 52 mm.
void ContactBatches::add_batches(const Model& model, const std::vector<Contact>& contacts, std::size_t begin,
                                 std::size_t end) {
  const std::size_t count = end - begin;
  const std::size_t runs = std::clamp<std::size_t>((count + 1) / 2, 1, lanes);
  const bool from_middle = manifolds_[begin].distance % 2 != 0;
  std::array<Run, lanes> run{};
  for (std::size_t i = 0; i < runs; ++i) {
    run[i] = {begin + count * i / runs, begin + count * (i + 1) / runs, (i >= lanes / 2) != from_middle};
  }
  for (std::size_t left = count; left > 0;) {
    std::array<Manifold, lanes> taken;
    int size = 0;
    const int batch = static_cast<int>(batches.size());
    const auto is_free = [&](int body) { return !moves(model.masses[body]) || last_batch_[body] != batch; };
    for (Run& own : run) {
      // A run that is finished takes manifolds from the other end of the longest run.
      Run& from = own.size() > 0 ? own : *std::ranges::max_element(run, {}, &Run::size);
      const bool helps = &from != &own;
      if (from.size() <= (helps ? 1 : 0)) continue;
      const Manifold& manifold = manifolds_[from.next(helps)];
      if (size > 0 && !(manifold.fits(taken[0]) && is_free(manifold.a) && is_free(manifold.b))) continue;
      last_batch_[manifold.a] = last_batch_[manifold.b] = batch;
      // A batch takes as long as its longest manifold, which is the last.
      int position = size++;
      for (; position > 0 && manifold.is_shorter(taken[position - 1]); --position)
        taken[position] = taken[position - 1];
      taken[position] = manifold;
      from.take(helps);
      --left;
    }
    add_batch(model, contacts, taken.data(), size);
  }
}

/// Returns whether the shapes are those that the batches were built for.
bool ContactBatches::have_shapes_of_batches() const {
  return std::ranges::equal(shapes, shapes_of_batches_, [](const PatchShape& shape, const auto& built) {
    return built == std::tuple(shape.collider_a, shape.collider_b, shape.corners);
  });
}

void ContactBatches::build(const Model& model, const std::vector<Contact>& contacts,
                           std::vector<PatchShape>& kept, const std::vector<Coordinates>& q) {
  reserve(model, contacts.capacity());
  shapes.swap(kept);
  formulations = 0;
  const bool has_points = !contacts.empty();
  // Reuse the last batches where both steps have the same patches and no points
  if (!has_points && had_no_points_ && have_shapes_of_batches()) {
    slides.assign(batches.size(), 0);
    return;
  }
  had_no_points_ = !has_points;
  batches.clear();
  counts_ = {};
  list_manifolds(model, contacts, q);
  shapes_of_batches_.clear();
  for (const PatchShape& shape : shapes)
    shapes_of_batches_.emplace_back(shape.collider_a, shape.collider_b, shape.corners);
  last_batch_.assign(model.masses.size(), -1);
  for (std::size_t begin = 0, end = 0; begin < manifolds_.size(); begin = end) {
    while (end < manifolds_.size() && manifolds_[end].distance == manifolds_[begin].distance) ++end;
    add_batches(model, contacts, begin, end);
  }
  normals.resize(counts_.points);
  frictions.resize(counts_.points);
  touching.resize(counts_.points);
  directions.resize(counts_.points);
  restitutions.resize(counts_.points);
  couplings.resize(counts_.couplings);
  patches.resize(counts_.patches);
  patch_corners.resize(counts_.corners);
  slides.assign(batches.size(), 0);
}

/// Reserves memory for `most` contacts, as there are at most as many manifolds.
void ContactBatches::reserve(const Model& model, std::size_t most) {
  const auto reserve_for = [most](auto&... vectors) { (vectors.reserve(most), ...); };
  reserve_for(manifolds_, batches, slides, normals, frictions, touching, directions, restitutions, shapes,
              shapes_of_batches_, patches, patch_corners, position_of_, in_order_);
  couplings.reserve(8 * most);
  partners_.reserve(2 * most);
  begin_.reserve(model.masses.size() + 1);
  reached_.reserve(model.masses.size());
}

}  // namespace substep
