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

std::string contact_markdown(const std::vector<ContactAblationCosts>& ablation) {
  std::string text = fmt::format("\n\n{}:\n\n| switched off |", contact_ablation_caption(ablation));
  for (const ContactAblationCosts& column : ablation) text += fmt::format(" {} |", column_title(column));
  text += "\n|---|";
  for (std::size_t i = 0; i < ablation.size(); ++i) text += "---:|";
  for (std::size_t i = 0; i < contact_ablations.size(); ++i) {
    text += fmt::format("\n| {} |", std::string(name(contact_ablations[i])));
    for (const ContactAblationCosts& column : ablation) text += fmt::format(" {} |", number(column.costs[i]));
  }
  return text;
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
  text += fmt::format("\n{}:\n\n| approximation |", ablation_caption);
  for (const AblationCosts& row : report.ablation)
    text += fmt::format(" {}, n = {} |", row.scene, row.substeps);
  text += "\n|---|";
  for (std::size_t i = 0; i < report.ablation.size(); ++i) text += "---|";
  for (std::size_t i = 0; i < approximations.size(); ++i) {
    text += fmt::format("\n| {} |", name(approximations[i]));
    for (const AblationCosts& row : report.ablation) text += fmt::format(" {} |", number(row.costs[i]));
  }
  text += contact_markdown(report.contact_ablation);
  text += fmt::format("\n\n{}:\n\n| |", energy_caption);
  for (const std::string& scene : report.energy_scenes) text += fmt::format(" {} |", scene);
  text += "\n|---|";
  for (std::size_t i = 0; i < report.energy_scenes.size(); ++i) text += "---|";
  for (const EnergyDrift& drift : report.energy) {
    text += fmt::format("\n| {} |", drift.run);
    for (const double growth : drift.growth) text += fmt::format(" {} |", number(growth));
  }
  return text + "\n";
}

}  // namespace substep
