#include "sim/commands/csv_lines.h"

#include <fmt/format.h>

#include <iterator>

namespace substep {
namespace {

/// Returns a body's name as a CSV field, quoted where it has commas or quotes.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

}  // namespace

std::string csv_lines(const Scene& scene, const State& state, double time, std::string_view more) {
  std::string text;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.inverse_mass == 0) continue;
    const Vector3& x = state.q[i].linear;
    const Quaternion r = state.q[i].angular * body.body_from_node.orientation;
    const Vector3& v = state.v[i].linear;
    const Vector3& w = state.v[i].angular;
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}{}\n", time,
                   csv_field(body.name), x.x(), x.y(), x.z(), r.w(), r.x(), r.y(), r.z(), v.x(), v.y(), v.z(),
                   w.x(), w.y(), w.z(), more);
  }
  return text;
}

}  // namespace substep
