#pragma once
/// What of a scene decides which algorithm suits it.

#include <string>
#include <string_view>

#include "sim/measure/motion.h"

namespace substep {

enum class ContactKind {
  none,      ///< nothing can touch
  standing,  ///< the reference leaves every body where it starts
  rolling,   ///< bodies with round shapes that move
  moving,    ///< what slides, falls or is hit
};

std::string_view name(ContactKind kind);
/// Throws Error for a name of none.
ContactKind contact_kind_named(std::string_view text);

struct SceneTraits {
  bool has_joints = false;
  bool has_loops = false;  ///< joints close a ring, or are more than one between two bodies; the world is one
  ContactKind contacts = ContactKind::none;
  double mass_ratio = 1;  ///< of the heaviest body that moves to the lightest
  /// Of the stiffest spring: how far its free oscillation gets in a step, h √(k/m), rad. Above 1 an explicit
  /// step could not follow it. Without springs 0.
  double spring_angle = 0;
};

SceneTraits traits_of(const Scene& scene, const ReferenceMotion& reference);

}  // namespace substep
