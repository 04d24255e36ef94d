#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

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

nlohmann::ordered_json json_number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

constexpr std::string_view ablation_caption =
    "Largest distance of a body's centre from A3 after 1 s with one approximation in A3, in m (plain joints)";

constexpr std::string_view energy_caption =
    "Largest rise of energy above the start's in 5 s, in J, of scenes that nothing drives (n = 4, m = 1)";

std::string contact_table(const std::vector<ContactAblationCosts>& ablation) {
  std::string text = fmt::format("\n\n{}\n{:32}", contact_ablation_caption(ablation), "");
  for (const ContactAblationCosts& column : ablation) text += fmt::format("{:>24}", column_title(column));
  for (std::size_t i = 0; i < contact_ablations.size(); ++i) {
    text += fmt::format("\n{:32}", std::string(name(contact_ablations[i])));
    for (const ContactAblationCosts& column : ablation)
      text += fmt::format("{:>24}", number(column.costs[i]));
  }
  return text;
}

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

nlohmann::ordered_json contact_json(const std::vector<ContactAblationCosts>& ablation) {
  nlohmann::ordered_json columns = nlohmann::ordered_json::array();
  for (const ContactAblationCosts& column : ablation) {
    nlohmann::ordered_json costs = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < contact_ablations.size(); ++i) {
      costs[std::string(name(contact_ablations[i]))] = json_number(column.costs[i]);
    }
    columns.push_back(
        {{"scene", column.scene}, {"what", column.what}, {"unit", column.unit}, {"costs", costs}});
  }
  return columns;
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

std::string to_table(const ClaimsReport& report) {
  std::string text;
  for (const Claim& claim : report.claims) {
    text += fmt::format("{}  {}\n{} ({})\n{}\n", claim.number, claim.verdict(), claim.claim, claim.section,
                        claim.measured);
    for (const TextTable& table : tables_of(claim)) text += to_text(table);
    text += '\n';
  }
  text += fmt::format("\n{}\n{:32}", ablation_caption, "");
  for (const AblationCosts& row : report.ablation) {
    text += fmt::format("{:>24}", fmt::format("{} n={}", row.scene, row.substeps));
  }
  for (std::size_t i = 0; i < approximations.size(); ++i) {
    text += fmt::format("\n{:32}", name(approximations[i]));
    for (const AblationCosts& row : report.ablation) text += fmt::format("{:>24}", number(row.costs[i]));
  }
  text += contact_table(report.contact_ablation);
  text += fmt::format("\n\n{}\n{:12}", energy_caption, "");
  for (const std::string& scene : report.energy_scenes) text += fmt::format("{:>26}", scene);
  for (const EnergyDrift& drift : report.energy) {
    text += fmt::format("\n{:12}", drift.run);
    for (const double growth : drift.growth) text += fmt::format("{:>26}", number(growth));
  }
  return text + "\n";
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

std::string to_json(const ClaimsReport& report) {
  nlohmann::ordered_json claims = nlohmann::ordered_json::array();
  for (const Claim& claim : report.claims) {
    nlohmann::ordered_json figures = nlohmann::ordered_json::array();
    for (const Figure& figure : claim.figures) {
      nlohmann::ordered_json values = nlohmann::ordered_json::array();
      for (const double value : figure.values) values.push_back(json_number(value));
      figures.push_back(
          {{"what", figure.what}, {"values", values}, {"unit", figure.unit}, {"timing", figure.timing}});
    }
    nlohmann::ordered_json cases = nlohmann::ordered_json::array();
    for (const Case& part : claim.cases) {
      cases.push_back({{"what", part.what}, {"holds", part.holds}, {"timing", part.timing}});
    }
    claims.push_back({{"number", claim.number},
                      {"section", claim.section},
                      {"claim", claim.claim},
                      {"measured", claim.measured},
                      {"columns", claim.columns},
                      {"figures", figures},
                      {"cases", cases},
                      {"verdict", claim.verdict()}});
  }
  nlohmann::ordered_json ablation = nlohmann::ordered_json::array();
  for (const AblationCosts& row : report.ablation) {
    nlohmann::ordered_json costs = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < approximations.size(); ++i) {
      costs[std::string(name(approximations[i]))] = json_number(row.costs[i]);
    }
    ablation.push_back({{"scene", row.scene}, {"substeps", row.substeps}, {"costs", costs}});
  }
  nlohmann::ordered_json energy = nlohmann::ordered_json::array();
  for (const EnergyDrift& drift : report.energy) {
    nlohmann::ordered_json scenes = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < drift.growth.size(); ++i) {
      scenes.push_back({{"scene", report.energy_scenes[i]},
                        {"growth", json_number(drift.growth[i])},
                        {"change", json_number(drift.change[i])}});
    }
    energy.push_back({{"run", drift.run}, {"scenes", scenes}});
  }
  return nlohmann::ordered_json{{"claims", claims},
                                {"ablation", ablation},
                                {"contact_ablation", contact_json(report.contact_ablation)},
                                {"energy", energy}}
             .dump(2) +
         "\n";
}

}  // namespace substep
