#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "sim/measure/claims.h"
#include "sim/measure/text_table.h"

namespace substep {
namespace {

std::string number(double value, bool timing = false) {
  // A value of a billion is that of a run that has blown up, finite or not.
  if (!(std::abs(value) < 1e9)) return "blows up";
  // Hide the digits of rounding, which depend on the order of a sum.
  if (value != 0 && std::abs(value) < 1e-12) return "<1e-12";
  // Print two digits of a timing: the third is noise.
  return timing ? fmt::format("~{:.2g}", value) : fmt::format("{:.3g}", value);
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

constexpr std::string_view energy_caption =
    "Largest rise of energy above the start's in 5 s, in J, of scenes that nothing drives (n = 4, m = 1)";

TextTable table_of(const std::vector<AblationCosts>& ablation) {
  TextTable table{{"approximation"}, {}};
  for (const AblationCosts& column : ablation)
    table.head.push_back(fmt::format("{}, n = {}", column.scene, column.substeps));
  for (std::size_t i = 0; i < approximations.size(); ++i) {
    std::vector<std::string> row{std::string(name(approximations[i]))};
    for (const AblationCosts& column : ablation) row.push_back(number(column.costs[i]));
    table.rows.push_back(std::move(row));
  }
  return table;
}

TextTable energy_table(const ClaimsReport& report) {
  TextTable table{{""}, {}};
  table.head.insert(table.head.end(), report.energy_scenes.begin(), report.energy_scenes.end());
  for (const EnergyDrift& drift : report.energy) {
    std::vector<std::string> row{drift.run};
    for (const double growth : drift.growth) row.push_back(number(growth));
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

std::string Claim::verdict() const {
  std::vector<std::string> holding;
  std::vector<std::string> failing;
  for (const Case& part : cases) (part.holds ? holding : failing).push_back(part.what);
  if (failing.empty()) return "holds";
  if (holding.empty()) return "does not hold";
  if (holding.size() <= failing.size()) return fmt::format("holds only: {}", fmt::join(holding, "; "));
  return fmt::format("holds except: {}", fmt::join(failing, "; "));
}

std::string to_markdown(const ClaimsReport& report) {
  std::string text;
  for (const Claim& claim : report.claims) {
    text += fmt::format("Claim {} ({}): {}. **It {}.**\n\n{}:\n\n{}\n", claim.number, claim.section,
                        claim.claim, claim.verdict(), claim.measured, figures_of(claim));
  }
  text += fmt::format("\n{}:\n\n{}\n{}:\n\n{}", ablation_caption, to_markdown(table_of(report.ablation)),
                      energy_caption, to_markdown(energy_table(report)));
  return text;
}

}  // namespace substep
