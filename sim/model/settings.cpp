#include "sim/model/settings.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "sim/error.h"

namespace substep {
namespace {

constexpr std::array<std::pair<Algorithm, std::string_view>, 5> algorithm_names{{{Algorithm::a1, "a1"},
                                                                                 {Algorithm::a2, "a2"},
                                                                                 {Algorithm::a3, "a3"},
                                                                                 {Algorithm::a4, "a4"},
                                                                                 {Algorithm::a5, "a5"}}};
constexpr std::array<std::pair<Algorithm, std::string_view>, 5> algorithm_titles{{{Algorithm::a1, "A1"},
                                                                                  {Algorithm::a2, "A2"},
                                                                                  {Algorithm::a3, "A3"},
                                                                                  {Algorithm::a4, "A4"},
                                                                                  {Algorithm::a5, "A5"}}};
constexpr std::array<std::pair<Joints, std::string_view>, 3> joints_names{
    {{Joints::rows, "rows"}, {Joints::plain, "plain"}, {Joints::stable, "stable"}}};

template <typename Names, typename Value>
std::string_view name_in(const Names& names, Value value) {
  for (const auto& [candidate, text] : names) {
    if (candidate == value) return text;
  }
  return "?";
}

std::string step_label(double step) {
  const double rate = 1 / step;
  if (std::abs(rate - std::round(rate)) < 1e-9 * rate) return fmt::format("h=1/{:.0f}", rate);
  return fmt::format("h={:g}", step);
}

}  // namespace

Settings default_settings(Algorithm algorithm) {
  constexpr int solves = 10;
  Settings settings;
  settings.algorithm = algorithm;
  settings.substeps = solves;
  settings.iterations = algorithm == Algorithm::a2 ? solves : 1;
  settings.tau = 0.6;
  settings.joints = Joints::stable;
  return settings;
}

std::string_view name(Algorithm algorithm) {
  return name_in(algorithm_names, algorithm);
}

std::string_view title_of(Algorithm algorithm) {
  return name_in(algorithm_titles, algorithm);
}
std::string_view name(Joints joints) {
  return name_in(joints_names, joints);
}

std::optional<Algorithm> algorithm_named(std::string_view text) {
  for (const auto& [value, candidate] : algorithm_names) {
    if (candidate == text) return value;
  }
  return std::nullopt;
}

std::optional<Joints> joints_named(std::string_view text) {
  for (const auto& [value, candidate] : joints_names) {
    if (candidate == text) return value;
  }
  return std::nullopt;
}

void check(const Settings& s) {
  // Written so that a NaN fails each test.
  if (!(s.step > 0 && s.step <= 10))
    throw Error(fmt::format("step {} s: must be above 0 and at most 10", s.step));
  if (!(s.substeps >= 1 && s.substeps <= 100000)) {
    throw Error(fmt::format("substeps {}: must be from 1 to 100000", s.substeps));
  }
  if (!(s.iterations >= 1 && s.iterations <= 100000)) {
    throw Error(fmt::format("iterations {}: must be from 1 to 100000", s.iterations));
  }
  if (!(s.tau > 0 && s.tau <= 4)) throw Error(fmt::format("tau {}: must be above 0 and at most 4", s.tau));
  if (!(s.kappa > 0 && s.kappa <= 2))
    throw Error(fmt::format("kappa {}: must be above 0 and at most 2", s.kappa));
  if (!(s.relaxation > 0 && s.relaxation < 2)) {
    throw Error(fmt::format("relaxation {}: must be above 0 and below 2", s.relaxation));
  }
  if (!(s.tolerance >= 0)) throw Error(fmt::format("tolerance {}: must not be negative", s.tolerance));
}

std::string label(const Settings& s) {
  const std::string step = step_label(s.step);
  switch (s.algorithm) {
    case Algorithm::a1:
      return fmt::format("A1  {}", step);
    case Algorithm::a2:
      return fmt::format("A2  m={}{}  {}", s.iterations,
                         s.relaxation == 1 ? "" : fmt::format(" ω={:g}", s.relaxation), step);
    default:
      break;
  }
  std::string text = fmt::format("{}  n={} m={}", title_of(s.algorithm), s.substeps, s.iterations);
  if (s.tau != 1 || s.kappa != 1) text += fmt::format(" τ={:g} κ={:g}", s.tau, s.kappa);
  text += fmt::format(" {}  {}", name(s.joints), step);
  return text;
}

}  // namespace substep
