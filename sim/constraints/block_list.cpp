// Lists the rows that form blocks, and the order in which they are solved.

#include "sim/constraints/formulate.h"

namespace substep {

void build_blocks(Problem& problem, Joints joints, const std::vector<Coordinates>& q) {
  Constraints& c = problem.c;
  const Model& model = *problem.model;
  c.blocks.clear();
  c.effective_masses.clear();
  problem.substeps.gyroscopic_change.resize(model.gyroscopic.size());
  int first = 0;
  const auto add = [&](Block::Kind kind, int rows, int component, int a, int b,
                       std::size_t source) -> Block& {
    Block x{};
    x.kind = kind;
    x.rows = static_cast<std::uint8_t>(rows);
    x.component = static_cast<std::uint8_t>(component);
    x.first = first;
    x.a = a;
    x.b = b;
    x.source = static_cast<int>(source);
    x.inverse_mass_a = model.masses[a].inverse_mass;
    x.inverse_mass_b = model.masses[b].inverse_mass;
    first += rows;
    if (rows > 1) {
      x.coupling = static_cast<int>(c.effective_masses.size());
      c.effective_masses.emplace_back();
    }
    c.blocks.push_back(x);
    return c.blocks.back();
  };
  const auto add_lock = [&](int rows, int a, int b, std::size_t source) {
    if (joints == Joints::rows) {
      for (int k = 0; k < rows; ++k) add(Block::Kind::lock, 1, k, a, b, source);
    } else {
      add(Block::Kind::lock, rows, 0, a, b, source).stable = joints == Joints::stable;
    }
  };
  for (std::size_t i = 0; i < model.locks.size(); ++i) {
    const Lock& lock = model.locks[i];
    const int rows = lock.kind == Lock::Kind::point || lock.kind == Lock::Kind::orientation ? 3 : 2;
    add_lock(rows, lock.at.a, lock.at.b, i);
  }
  for (std::size_t i = 0; i < model.limits.size(); ++i) {
    const Limit& limit = model.limits[i];
    // A distance that is both bounds is the report's stiff spring, which is stable. Other two-sided limits
    // are not in its list; a slot that turns with its body errs the more in A5, the more sub-steps there are.
    const bool is_stiff_spring =
        limit.side == Limit::Side::both && limit.coordinate.kind == JointCoordinate::Kind::distance;
    const bool stable = joints == Joints::stable && is_stiff_spring;
    add(Block::Kind::limit, 1, 0, limit.at.a, limit.at.b, i).stable = stable;
  }
  for (std::size_t i = 0; i < model.drives.size(); ++i) {
    add(Block::Kind::drive, 1, 0, model.drives[i].at.a, model.drives[i].at.b, i);
  }
  std::vector<PatchShape> none;
  c.contacts.build(model, *problem.contacts, problem.kept_patches ? *problem.kept_patches : none, q);
  c.rows.resize(first);
  problem.order.interleave(model, c);
}

}  // namespace substep
