#pragma once
/// Measures how well contacts hold a scene with given settings.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/model/settings.h"

namespace substep {

/// The costs of one scene.
struct ContactCosts {
  std::string scene;
  std::string what;           ///< "largest displacement of a body in 5 s": what a cost is
  std::vector<double> costs;  ///< m, by settings; less is better; not finite where the run diverged
};

/// Runs box_stack, box_pyramid or balls_on_tray of `folder` with each of the settings, at the scene's step.
/// Throws Error when the scene cannot be read.
ContactCosts contact_costs(const std::filesystem::path& folder, const std::string& scene,
                           const std::vector<Settings>& settings);

}  // namespace substep
