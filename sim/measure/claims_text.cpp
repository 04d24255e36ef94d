#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "sim/measure/claims.h"
#include "sim/measure/text_table.h"

namespace substep {
namespace {

std::string number(double value, bool timing = false) {
  // Nothing measured here is a billion: a run that has gone so far has blown up, finite or not.
  if (!(std::abs(value) < 1e9)) return "blows up";
  // Rounding: its digits depend on the order of a sum.
  if (value != 0 && std::abs(value) < 1e-12) return "<1e-12";
  // A timing's third digit says nothing.
  return timing ? fmt::format("~{:.2g}", value) : fmt::format("{:.3g}", value);
}

/// The figures of a claim with several values, or those with one.
TextTable table_of(const Claim& claim, bool has_several) {
  TextTable table{{""}, {}};
  if (has_several) {
    table.head.insert(table.head.end(), claim.columns.begin(), claim.columns.end());
  } else {
    table.head.push_back("value");
  }
  for (const Figure& figure : claim.figures) {
    if ((figure.values.size() > 1) != has_several) continue;
    const std::string unit = figure.unit.empty() ? "" : fmt::format(", {}", figure.unit);
    std::vector<std::string> row{figure.what + unit};
    for (const double value : figure.values) row.push_back(number(value, figure.timing));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::vector<TextTable> tables_of(const Claim& claim) {
  std::vector<TextTable> tables;
  for (const bool has_several : {true, false}) {
    TextTable table = table_of(claim, has_several);
    if (!table.rows.empty()) tables.push_back(std::move(table));
  }
  return tables;
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
    text += fmt::format("Claim {} ({}): {}. **It {}.**\n\n{}:\n", claim.number, claim.section, claim.claim,
                        claim.verdict(), claim.measured);
    for (const TextTable& table : tables_of(claim)) text += fmt::format("\n{}", to_markdown(table));
    text += '\n';
  }
  text += fmt::format("\n{}:\n\n{}\n{}:\n\n{}", ablation_caption, to_markdown(table_of(report.ablation)),
                      energy_caption, to_markdown(energy_table(report)));
  return text;
}

}  // namespace substep
