#include "sim/measure/metrics_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "sim/error.h"

namespace substep {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
Json number(const std::optional<double>& value) {
  return value ? number(*value) : Json("none");
}
Json spread(const Spread& value) {
  return {{"rms", number(value.rms)}, {"largest", number(value.largest)}};
}

double number_in(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}
std::optional<double> optional_in(const Json& json) {
  if (json.is_string()) return std::nullopt;
  return number_in(json);
}
Spread spread_in(const Json& json) {
  return {number_in(json.at("rms")), number_in(json.at("largest"))};
}

constexpr std::array bounds{std::pair{Bound::equal, "value"}, std::pair{Bound::at_most, "at_most"},
                            std::pair{Bound::at_least, "at_least"}};

Json figures(const std::vector<ExpectedFigure>& expected) {
  Json list = Json::array();
  for (const ExpectedFigure& x : expected) {
    const auto* const bound = std::ranges::find(bounds, x.bound, [](const auto& pair) { return pair.first; });
    list.push_back({{"name", x.name},
                    {"unit", x.unit},
                    {bound->second, x.expected},
                    {"tolerance", x.tolerance},
                    {"measured", number(x.measured)},
                    {"error", number(x.error())}});
  }
  return list;
}

std::vector<ExpectedFigure> figures_in(const Json& list) {
  std::vector<ExpectedFigure> figures;
  for (const Json& json : list) {
    ExpectedFigure x;
    x.name = json.at("name").get<std::string>();
    x.unit = json.at("unit").get<std::string>();
    for (const auto& [bound, key] : bounds) {
      if (!json.contains(key)) continue;
      x.bound = bound;
      x.expected = json.at(key).get<double>();
    }
    x.tolerance = json.at("tolerance").get<double>();
    x.measured = number_in(json.at("measured"));
    figures.push_back(std::move(x));
  }
  return figures;
}

template <typename Read>
auto reading(const Json& json, const Read& read) {
  try {
    return read(json);
  } catch (const Json::exception& error) {
    throw Error(fmt::format("not what a sweep wrote: {}", error.what()));
  }
}

}  // namespace

Json to_json(const Metrics& x) {
  return {{"position", spread(x.error.position)},
          {"orientation", spread(x.error.orientation)},
          {"stepping_error", number(x.parts.stepping)},
          {"solver_error", number(x.parts.solver)},
          {"model_error", number(x.parts.model)},
          {"residual", spread(x.residual)},
          {"row_solves", x.row_solves},
          {"joint_gap", number(x.joint_gap)},
          {"penetration", number(x.penetration)},
          {"energy_change", number(x.energy_change)},
          {"energy_growth", number(x.energy_growth)},
          {"energy_scale", number(x.energy_scale)},
          {"moved", number(x.moved)},
          {"momentum", number(x.momentum)},
          {"angular_momentum", number(x.angular_momentum)},
          {"passages", x.passages},
          {"diverged", number(x.diverged)},
          {"bounded", x.bounded},
          {"expected", figures(x.expected)}};
}

Metrics metrics_in(const Json& json) {
  return reading(json, [](const Json& j) {
    Metrics x;
    x.error = {spread_in(j.at("position")), spread_in(j.at("orientation"))};
    x.parts = {number_in(j.at("stepping_error")), optional_in(j.at("solver_error")),
               optional_in(j.at("model_error"))};
    x.residual = spread_in(j.at("residual"));
    x.row_solves = j.at("row_solves").get<std::int64_t>();
    x.joint_gap = number_in(j.at("joint_gap"));
    x.penetration = number_in(j.at("penetration"));
    x.energy_change = number_in(j.at("energy_change"));
    x.energy_growth = number_in(j.at("energy_growth"));
    x.energy_scale = number_in(j.at("energy_scale"));
    x.moved = number_in(j.at("moved"));
    x.momentum = optional_in(j.at("momentum"));
    x.angular_momentum = optional_in(j.at("angular_momentum"));
    x.passages = j.at("passages").get<std::vector<std::string>>();
    x.diverged = optional_in(j.at("diverged"));
    x.bounded = j.at("bounded").get<bool>();
    x.expected = figures_in(j.at("expected"));
    return x;
  });
}

Json to_json(const RunTimes& t) {
  return {{"median", t.median},           {"smallest", t.smallest},    {"largest", t.largest},
          {"repetitions", t.repetitions}, {"s1", t.stages.geometry},   {"s2", t.stages.formulation},
          {"s3", t.stages.velocities},    {"s4", t.stages.coordinates}};
}

RunTimes times_in(const Json& json) {
  return reading(json, [](const Json& j) {
    return RunTimes{j.at("median").get<double>(),
                    j.at("smallest").get<double>(),
                    j.at("largest").get<double>(),
                    j.at("repetitions").get<int>(),
                    {j.at("s1").get<double>(), j.at("s2").get<double>(), j.at("s3").get<double>(),
                     j.at("s4").get<double>()}};
  });
}

}  // namespace substep
