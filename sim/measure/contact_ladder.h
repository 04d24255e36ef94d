#pragma once
/// What each reading of contacts (ContactReading) costs when it is taken out of A5 by itself.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/ladder.h"

namespace substep {

/// The prices of one scene, at A5's default settings.
struct ContactPrices {
  std::string scene;
  std::string what;            ///< "largest displacement in 5 s": what a price is
  std::string unit;            ///< "m", "m/s"
  std::vector<double> prices;  ///< by `contact_rungs`; less is better; not finite where it diverged
};

/// "box_stack [m]": heads a column of prices.
std::string column_title(const ContactPrices& prices);
/// "order of the file"; with an asterisk where that goes beyond the report.
std::string row_title(ContactRung rung);
/// What a table of prices shows: settings, what a price is, and the asterisk.
std::string contact_ladder_caption(const std::vector<ContactPrices>& ladder);

/// On box_stack, box_pyramid, balls_on_tray, powered_wheel and dominoes of `folder`: some seconds, the same
/// in every run. Throws Error when a scene cannot be read.
std::vector<ContactPrices> contact_ladder(const std::filesystem::path& folder);

/// The same of one of these scenes.
ContactPrices contact_prices(const std::filesystem::path& folder, const std::string& scene);

}  // namespace substep
