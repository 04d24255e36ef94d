#pragma once
/// Titles of panels: each is called by what differs from the others, with a legend of what they share.

#include <string>
#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

struct Titles {
  std::vector<std::string> words;  ///< by run, after its name: "2 sub-steps", "exact", ""
  std::string shared;              ///< "10 sub-steps · τ=0.6/0.9 · stable joints · 60 Hz"
};

/// Puts settings that differ between panels into their words, and the others into the legend. A panel's own
/// title replaces its words.
Titles titles_of(const std::vector<Run>& runs);

}  // namespace substep::render
