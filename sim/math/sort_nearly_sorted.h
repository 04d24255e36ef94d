#pragma once
/// Sorting of lists that are nearly sorted, as from step to step.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace substep {

/// Sorts items, no two of which are equal, by insertion; by std::ranges::sort after 8 moves per item in all.
template <class Item, class Precedes>
void sort_nearly_sorted(std::vector<Item>& items, const Precedes& precedes) {
  std::size_t moves = 8 * items.size();
  for (std::size_t i = 1; i < items.size(); ++i) {
    const Item item = items[i];
    std::size_t position = i;
    for (; position > 0 && moves > 0 && precedes(item, items[position - 1]); --position, --moves)
      items[position] = items[position - 1];
    items[position] = item;
    if (moves > 0) continue;
    std::ranges::sort(items, precedes);
    return;
  }
}

}  // namespace substep
