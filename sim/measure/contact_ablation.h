#pragma once
/// Measures the cost of each option of contacts (ContactReading) when it is switched off in A5.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/measure/ablation.h"

namespace substep {

/// The costs of one scene, at A5's default settings.
struct ContactAblationCosts {
  std::string scene;
  std::string what;           ///< "largest displacement in 5 s": what a cost is
  std::string unit;           ///< "m", "m/s"
  std::vector<double> costs;  ///< by `contact_ablations`; less is better; not finite where it diverged
};

/// "box_stack [m]": heads a column of costs.
std::string column_title(const ContactAblationCosts& costs);
/// Returns the caption of a table of costs: settings, and the meaning of a cost.
std::string contact_ablation_caption(const std::vector<ContactAblationCosts>& ablation);

/// On box_stack, box_pyramid, balls_on_tray, powered_wheel and dominoes of `folder`: some seconds, the same
/// in every run. Throws Error when a scene cannot be read.
std::vector<ContactAblationCosts> contact_ablation(const std::filesystem::path& folder);

/// One of these scenes with both options on and `settings` of one's own, each at the scene's step: costs in
/// their order.
ContactAblationCosts contact_costs(const std::filesystem::path& folder, const std::string& scene,
                                   const std::vector<Settings>& settings);

}  // namespace substep
