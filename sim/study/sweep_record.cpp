#include "sim/study/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "sim/error.h"
#include "sim/loading/json_value.h"
#include "sim/measure/json.h"
#include "sim/measure/text_table.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

std::string field(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : "inf";
}
std::string field(const std::optional<double>& value) {
  return value ? field(*value) : "";
}

/// Returns the columns that identify a run.
std::string columns_of(const SweepRecord& r) {
  std::string text = csv_field(r.scene);
  for (const SettingsField& field : settings_fields) {
    const bool is_engine = field.name == "algorithm" && !r.engine.empty();
    text += fmt::format(",{}", is_engine ? r.engine : text_of(r.settings, field));
  }
  return fmt::format("{},\"{}\"", text, r.label);
}

std::string run_columns() {
  std::string text = "scene";
  for (const SettingsField& field : settings_fields) text += fmt::format(",{}", field.name);
  return text + ",label";
}

/// Throws Error for a number that no run can have, since the file's numbers go into tables and figures.
void require_possible(const SweepRecord& r, const Json& json) {
  const auto require = [&r](bool possible, std::string_view what, double value) {
    if (!possible) throw Error("not what a sweep wrote: '{}' of {} is {}", what, r.key, value);
  };
  check(r.settings);
  require(r.size > 0, "size", r.size);
  require(r.duration > 0, "duration", r.duration);
  const Json none = Json::object();
  for (const Json& part :
       {json, json.value("metrics", none), json.value("times", none), json.value("limit", none)}) {
    for (const auto& [what, value] : part.items()) {
      const double number = value.is_number() ? value.get<double>() : 0;
      require(number >= 0 || what == "energy_change", what, number);
      if (!value.is_object() || !value.contains("rms") || value["rms"].is_null()) continue;
      // Null is infinite: the largest error of a diverged run.
      const auto rms = value["rms"].get<double>();
      const double largest = value.at("largest").is_null() ? infinity : value["largest"].get<double>();
      require(rms >= 0 && largest >= rms * (1 - 1e-9), what, rms);
    }
  }
}

constexpr std::array<std::string_view, 3> contact_kinds{"none", "standing", "moving"};

/// Calls `visit` with the keys of the JSON that come before the settings, and their values.
void visit_names(auto& record, auto&& visit) {
  visit("key", record.key);
  visit("scene", record.scene);
  visit("engine", record.engine);
  visit("label", record.label);
}

/// Calls `visit` with the keys that come after the settings, and their values.
void visit_figures(auto& record, auto&& visit) {
  visit("size", record.size);
  visit("duration", record.duration);
  visit("reference", record.reference);
  visit("uncertainty", record.uncertainty);
  visit("turn_uncertainty", record.turn_uncertainty);
  visit("horizon", record.horizon);
  visit("parting", record.divergence_point);
  visit("omitted", record.omitted);
}

}  // namespace

std::string to_json(const SweepRecord& r) {
  Json json;
  const auto write = [&](const char* key, const auto& value) { json[key] = value; };
  visit_names(r, write);
  json.update(to_json(r.settings));
  write("divisions", r.divisions);
  write("contacts", contact_kinds.at(static_cast<std::size_t>(r.contacts)));
  visit_figures(r, write);
  if (r.substep_radius) write("substep_radius", *r.substep_radius);
  if (r.metrics) write("metrics", to_json(*r.metrics));
  if (r.limit) {
    json["limit"] = {{"divisions", r.limit->divisions}, {"most", r.limit->most}, {"runs", r.limit->runs}};
  }
  if (r.times) write("times", to_json(*r.times));
  return json.dump();
}

SweepRecord record_in(const std::string& text) {
  try {
    const Json json = parse_json(text, "not what a sweep wrote");
    SweepRecord r;
    const auto read = [&](const char* key, auto& value) { json.at(key).get_to(value); };
    visit_names(r, read);
    visit_figures(r, read);
    read("divisions", r.divisions);
    r.settings = settings_in(json);
    const auto kind = std::ranges::find(contact_kinds, json.at("contacts").get<std::string>());
    if (kind == contact_kinds.end())
      throw Error("not what a sweep wrote: {} is no kind of contacts", json["contacts"].dump());
    r.contacts = static_cast<ContactKind>(kind - contact_kinds.begin());
    if (json.contains("substep_radius")) read("substep_radius", r.substep_radius.emplace());
    if (json.contains("metrics")) r.metrics = metrics_in(json["metrics"]);
    if (json.contains("times")) r.times = times_in(json["times"]);
    if (json.contains("limit")) {
      const Json& limit = json["limit"];
      r.limit = StabilityLimit{limit.at("divisions").get<int>(), limit.at("most").get<int>(),
                               limit.at("runs").get<int>()};
    }
    require_possible(r, json);
    return r;
  } catch (const Json::exception& error) {
    throw Error("not what a sweep wrote: {}", error.what());
  }
}

std::string errors_csv(const std::vector<SweepRecord>& records) {
  std::string text = fmt::format(
      "{},size,horizon,uncertainty,position_rms,position_largest,turn_rms,turn_largest,stepping_error,"
      "solver_error,model_error,residual_rms,residual_largest,row_solves,joint_gap,penetration,energy_change,"
      "energy_growth,moved,momentum,angular_momentum,diverged,bounded\n",
      run_columns());
  for (const SweepRecord& r : records) {
    if (!r.metrics) continue;
    const Metrics& x = *r.metrics;
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                        columns_of(r), field(r.size), field(r.horizon), field(r.uncertainty),
                        field(x.error.position.rms), field(x.error.position.largest),
                        field(x.error.orientation.rms), field(x.error.orientation.largest),
                        field(x.parts.stepping), field(x.parts.solver), field(x.parts.model),
                        field(x.residual.rms), field(x.residual.largest), x.row_solves, field(x.joint_gap),
                        field(x.penetration), field(x.energy_change), field(x.energy_growth), field(x.moved),
                        field(x.momentum), field(x.angular_momentum), field(x.diverged), x.bounded ? 1 : 0);
  }
  return text;
}

std::string times_csv(const std::vector<SweepRecord>& records) {
  std::string text =
      fmt::format("{},seconds_median,seconds_least,seconds_most,repetitions,s1,s2,s3,s4\n", run_columns());
  for (const SweepRecord& r : records) {
    if (!r.times) continue;
    const RunTimes& t = *r.times;
    text += fmt::format("{},{:.4g},{:.4g},{:.4g},{},{:.4g},{:.4g},{:.4g},{:.4g}\n", columns_of(r), t.median,
                        t.smallest, t.largest, t.repetitions, t.stages.geometry, t.stages.formulation,
                        t.stages.velocities, t.stages.coordinates);
  }
  return text;
}

}  // namespace substep
