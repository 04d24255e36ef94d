#include "sim/measure/claims.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>

#include "sim/measure/ablation.h"
#include "sim/measure/claims_measurement.h"
#include "sim/measure/text_table.h"

namespace substep {
namespace {

/// Returns a value with three digits, a timing with two, and "blows up" from 1e9 on.
std::string number(double value, bool timing = false) {
  if (!(std::abs(value) < 1e9)) return "blows up";
  // Print two digits of a timing: the third is noise.
  return timing ? fmt::format("~{:.2g}", value) : short_number(value);
}

/// Returns a table of the figures with several values, then a list of those with one.
std::string figures_of(const Claim& claim) {
  TextTable table{{""}, {}};
  table.head.insert(table.head.end(), claim.columns.begin(), claim.columns.end());
  std::string list;
  for (const Figure& figure : claim.figures) {
    if (figure.values.size() == 1) {
      const std::string unit = figure.unit.empty() ? "" : fmt::format(" {}", figure.unit);
      list += fmt::format("- {}: {}{}\n", figure.what, number(figure.values.front(), figure.timing), unit);
      continue;
    }
    const std::string unit = figure.unit.empty() ? "" : fmt::format(", {}", figure.unit);
    std::vector<std::string> row{figure.what + unit};
    for (const double value : figure.values) row.push_back(number(value, figure.timing));
    table.rows.push_back(std::move(row));
  }
  std::string text = table.rows.empty() ? "" : to_markdown(table);
  if (!text.empty() && !list.empty()) text += '\n';
  return text + list;
}

constexpr std::string_view ablation_caption =
    "Largest distance of a body's centre from A3 after 1 s with one approximation in A3, in m (plain joints)";

TextTable ablation_table(claims::Measurement& measurement) {
  TextTable table{{"approximation"}, {}};
  for (const Approximation& approximation : approximations)
    table.rows.push_back({std::string(approximation.name)});
  // The heavy chain needs more sub-steps to stay a chain at all.
  for (const auto& [scene, n] : {std::pair{"pendulum", 4},
                                 {"rod_chain", 4},
                                 {"tumbling rod_chain", 4},
                                 {"heavy_chain", 16},
                                 {"powered_wheel", 4}}) {
    table.head.push_back(fmt::format("{}, n = {}", scene, n));
    const std::vector<double> costs = ablation_costs(measurement.scene(scene), n, claims::horizon);
    for (std::size_t i = 0; i < costs.size(); ++i) table.rows[i].push_back(number(costs[i]));
  }
  return table;
}

}  // namespace

std::string measure_claims(const std::filesystem::path& folder, const std::function<void(double)>& progress) {
  using namespace claims;
  Measurement measurement(folder);
  constexpr std::array all{claim1,  claim2,  claim3,  claim4,  claim5,  claim6,  claim7,  claim8,  claim9,
                           claim10, claim11, claim12, claim13, claim14, claim15, claim16, claim17, claim18};
  std::string text;
  double done = 0;
  for (const auto measure : all) {
    progress(done++ / all.size());
    const Claim claim = measure(measurement);
    text += fmt::format("Claim {} ({}): {}. **It {}.**\n\n{}:\n\n{}\n", claim.number, claim.section,
                        claim.claim, claim.verdict(), claim.measured, figures_of(claim));
  }
  return text + fmt::format("\n{}:\n\n{}", ablation_caption, to_markdown(ablation_table(measurement)));
}

std::string Claim::verdict() const {
  std::vector<std::string> holding;
  std::vector<std::string> failing;
  for (const Case& part : cases) (part.holds ? holding : failing).push_back(part.what);
  if (failing.empty()) return "holds";
  if (holding.empty()) return "does not hold";
  if (holding.size() <= failing.size()) return fmt::format("holds only: {}", fmt::join(holding, "; "));
  return fmt::format("holds except: {}", fmt::join(failing, "; "));
}

}  // namespace substep
