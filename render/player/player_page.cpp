#include "render/player/player_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "render/animated_glb.h"
#include "render/body_mesh.h"
#include "render/camera.h"
#include "render/ground.h"
#include "render/image.h"
#include "render/lighting.h"
#include "render/markup.h"
#include "render/renderer.h"
#include "render/shaders.h"
#include "render/textures.h"
#include "render/video/composition.h"
#include "render/video/film_camera.h"
#include "render/video/overlay.h"
#include "sim/loading/json_value.h"
#include "sim/math/base64.h"
#include "sim/measure/invariants.h"
#include "sim/measure/motion.h"
#include "sim/model/model.h"

namespace substep::embedded {
std::string_view player_html();
std::string_view player_css();
std::string_view recording_js();
std::string_view shaders_js();
std::string_view camera_js();
std::string_view bodies_js();
std::string_view painter_js();
std::string_view strip_js();
std::string_view marks_js();
std::string_view player_js();
}  // namespace substep::embedded

namespace substep::render {
namespace {

Json list(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

Json list(const glm::vec4& v) {
  return {v.x, v.y, v.z};
}

/// Returns values rounded to four digits; 1e6 for infinite ones.
Json rounded(const std::vector<double>& values) {
  Json result = Json::array();
  for (const double value : values) {
    const double digit = value != 0 ? std::pow(10.0, std::floor(std::log10(std::abs(value))) - 3) : 1;
    result.push_back(std::isfinite(value) ? std::round(value / digit) * digit : 1e6);
  }
  return result;
}

/// Returns the tangent of the angle to the side that the picture must show: of the outermost corner in view.
double side_of(const View& view, std::span<const Part> parts,
               std::span<const std::vector<Coordinates>> frames) {
  double side = 0;
  for (const std::vector<Coordinates>& frame : frames) {
    for (const Part& part : parts) {
      if (is_scenery(part, parts)) continue;
      for (const Vector3& corner : part.corners_at(frame[part.body])) {
        const Vector3 p = corner - to_eigen(view.eye);
        const double tangent = std::abs(p.dot(to_eigen(view.right))) / p.dot(to_eigen(view.forward));
        if (tangent > side && tangent < view.tangent_x) side = tangent;
      }
    }
  }
  return std::min(1.08 * side, view.tangent_x);
}

/// Returns the film's camera, and the point before it that the page's camera turns about.
Json view_of(const Scene& scene, const Comparison& comparison, std::span<const Part> parts) {
  const std::vector<std::vector<Coordinates>> seen = seen_frames(scene, comparison);
  const View view = Renderer(scene, {.width = 320, .height = 180, .steps_back = true}, seen).view();
  const Vector3 eye = to_eigen(view.eye);
  const double distance =
      std::max((middle_of(scene) - eye).dot(to_eigen(view.forward)), 0.1 * size_of(scene));
  return {{"eye", list(eye)},
          {"target", list(Vector3(eye + distance * to_eigen(view.forward)))},
          {"tangent", view.tangent_y},
          {"side", side_of(view, parts, seen)}};
}

/// Returns the uniforms of the lamps.
Json lamps_for_page(const Lamps& lamps) {
  Json json = {{"count", lamps.count}};
  for (const auto& [name, values] : {std::pair("places", &lamps.places), std::pair("axes", &lamps.axes),
                                     std::pair("cones", &lamps.cones), std::pair("colors", &lamps.colors)}) {
    json[name] = Json::array();
    for (int i = 0; i < lamps.count; ++i) {
      for (int c = 0; c < 4; ++c) json[name].push_back((*values)[i][c]);
    }
  }
  return json;
}

Json light_of(const Scene& scene, std::span<const Part> parts) {
  FrameUniforms frame{};
  const double ground = ground_height(scene, parts);
  const Lamps lamps = lamps_of(scene, parts);
  set_light(frame, scene, lamps, ground);
  const auto four = [](const glm::vec4& v) { return Json{v.x, v.y, v.z, v.w}; };
  return {{"to_sun", four(frame.to_sun)},
          {"key", four(frame.key)},
          {"sun", list(frame.sun)},
          {"zenith", list(frame.zenith)},
          {"horizon", list(frame.horizon)},
          {"bounce", list(frame.bounce)},
          {"ground_color", list(frame.ground_color)},
          {"ground", ground},
          {"lamps", lamps_for_page(lamps)}};
}

/// Returns the bodies, each with the squares of its radii of gyration in the form that bodyError() of
/// recording.js takes.
Json bodies_of(const Scene& scene) {
  Json bodies = Json::array();
  for (const Body& body : scene.bodies) {
    Vector3 radius = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      if (body.inverse_inertia[axis] > 0) radius[axis] = body.inverse_mass / body.inverse_inertia[axis];
    }
    bodies.push_back(
        {{"name", body.name}, {"moves", body.inverse_mass > 0}, {"squared_gyration_radius", list(radius)}});
  }
  return bodies;
}

Json joints_of(const Scene& scene) {
  Json joints = Json::array();
  for (const Joint& joint : scene.joints) {
    if (!holds_anchors_together(joint)) continue;
    joints.push_back({{"bodies", {joint.body_a, joint.body_b}},
                      {"anchors", {list(joint.frame_a.position), list(joint.frame_b.position)}}});
  }
  return joints;
}

/// A pose in whole units: x, y, z and the quaternion's x, y, z, w.
using WholePose = std::array<std::int64_t, 7>;

/// Steps per unit in which a quaternion's components are stored: rotations are exact to 3e-5 rad.
constexpr double turn_parts = 65536;

/// Returns the pose in whole units, positions clamped to 1e5 m. Takes the quaternion of the rotation that is
/// nearer to `before`; returns `before` for a pose that is not finite.
WholePose whole(const Coordinates& q, double unit, const WholePose& before) {
  constexpr double far = 1e5;
  if (!q.linear.allFinite() || !q.angular.coeffs().allFinite()) return before;
  WholePose result = before;
  const Eigen::Vector4d turn = q.angular.coeffs();
  double same = 0;
  for (int i = 0; i < 4; ++i) same += turn[i] * static_cast<double>(before[3 + i]);
  for (int i = 0; i < 3; ++i) result[i] = std::llround(std::clamp(q.linear[i], -far, far) / unit);
  for (int i = 0; i < 4; ++i) result[3 + i] = std::llround((same < 0 ? -1 : 1) * turn[i] * turn_parts);
  return result;
}

/// Appends a number in zigzag (0, −1, 1, −2 … as 0, 1, 2, 3 …), in groups of seven bits, the lowest first;
/// the eighth bit is set where more follow.
void append(std::string& stream, std::int64_t change) {
  auto left = (static_cast<std::uint64_t>(change) << 1) ^ static_cast<std::uint64_t>(change >> 63);
  for (; left >= 128; left >>= 7) stream += static_cast<char>((left & 127) | 128);
  stream += static_cast<char>(left);
}

/// Returns the changes from frame to frame of the poses, body by body without the world, number by number.
/// Without frames, the stream holds the scene's start.
std::string pose_stream(const Scene& scene, std::vector<std::vector<Coordinates>> frames, double unit) {
  if (frames.empty()) frames = {initial_state(scene).q};
  std::string stream;
  for (std::size_t body = 1; body < frames.front().size(); ++body) {
    std::vector<WholePose> track(1);
    for (const auto& frame : frames) track.push_back(whole(frame[body], unit, track.back()));
    for (std::size_t i = 0; i < track[0].size(); ++i) {
      for (std::size_t k = 1; k < track.size(); ++k) append(stream, track[k][i] - track[k - 1][i]);
    }
  }
  return stream;
}

Json panels_of(const Comparison& comparison) {
  Json panels = Json::array();
  const Titles titles = titles_of(comparison.runs);
  for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
    const Run& run = comparison.runs[i];
    const Dash dash = dash_of(i);
    Json panel = {{"name", name_of(run.panel)},
                  {"words", titles.words[i]},
                  {"color", html_color(accent(run.panel))},
                  {"dash", {dash.drawn, dash.left_out}},
                  {"reference", run.is_reference()},
                  {"errors", rounded(run.errors)},
                  {"gaps", rounded(run.quantities.gaps)},
                  {"energies", rounded(run.quantities.energies)},
                  {"deepest", rounded(run.quantities.deepest)},
                  {"expected", rounded(run.quantities.expected)},
                  {"frames", std::max<std::size_t>(1, run.poses.size())}};
    if (!run.refusal.empty()) panel["refusal"] = run.refusal;
    if (run.diverged) panel["fate"] = fmt::format("diverged at t = {:.2f} s", *run.diverged);
    panels.push_back(std::move(panel));
  }
  return panels;
}

/// Returns the kinds of strips, the comparison's own first, each with the panels' key of its values and its
/// axis.
Json strips_of(const Comparison& comparison) {
  constexpr std::array<std::pair<Strip, const char*>, 5> all{{{Strip::error, "errors"},
                                                              {Strip::expected, "expected"},
                                                              {Strip::gap, "gaps"},
                                                              {Strip::depth, "deepest"},
                                                              {Strip::energy, "energies"}}};
  Json strips = Json::array();
  for (const auto& [strip, key] : all) {
    const bool is_known = std::ranges::any_of(
        comparison.runs, [&, of = strip](const Run& run) { return !series_of(run, of).empty(); });
    if (!is_known) continue;
    const StripAxis axis = axis_of(comparison, strip);
    Json entry{{"name", name_of(strip)},
               {"words", words_of(comparison, strip)},
               {"key", key},
               {"logarithmic", axis.is_logarithmic},
               {"mark", axis.mark},
               {"unit", axis.unit},
               {"scale", axis.is_logarithmic ? Json{axis.lower, axis.upper} : Json{axis.low, axis.high}}};
    strips.insert(strip == comparison.strip ? strips.begin() : strips.end(), std::move(entry));
  }
  return strips;
}

/// Returns JSON for a <script>, without '<', which could end the tag. Names that are not UTF-8 get a
/// replacement character.
std::string for_page(const Json& json) {
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;) text.replace(at, 1, "\\u003c");
  return text;
}

}  // namespace

QuantityChoice player_quantities(const Scene& scene) {
  QuantityChoice quantities;
  quantities.gap = !JointGapMeter(scene).is_empty();
  quantities.energy = true;
  return quantities;
}

std::string player_page(const Scene& scene, const Comparison& comparison, const std::string& title,
                        double speed) {
  // Quantum of stored positions, m: the largest power of two that is at most 4e-6 of the scene's size.
  const double unit = std::exp2(std::floor(std::log2(std::max(size_of(scene), 1e-6) * 4e-6)));
  const StripAxis scale = axis_of(comparison, Strip::error);
  const BodyMesh mesh = gather_body_mesh(scene);
  const std::vector<Part>& parts = mesh.parts;
  Json data = {{"title", title},
               {"scene", scene.name},
               {"speed", speed},
               {"times", comparison.times},
               {"unit", unit},
               {"turn_parts", turn_parts},
               {"bodies", bodies_of(scene)},
               {"joints", joints_of(scene)},
               {"panels", panels_of(comparison)},
               {"shared", titles_of(comparison.runs).shared},
               {"scale", {scale.lower, scale.upper}},
               {"strips", strips_of(comparison)},
               {"ramp", tint_ramp},
               {"view", view_of(scene, comparison, parts)},
               {"light", light_of(scene, parts)},
               {"looks", needs_looks(scene)}};
  const std::string glb = animated_glb(with_smaller_images(scene, mesh.surfaces, ImageLimits{}), {}, 0);
  std::string poses;
  for (const Run& run : comparison.runs) {
    // A reference panel's poses stand once, at the end.
    if (!run.is_reference()) poses += pose_stream(scene, run.poses, unit);
  }
  if (comparison.reference) {
    const ReferenceRun& reference = *comparison.reference;
    poses += pose_stream(scene, reference.poses, unit);
    data["reference"] = {{"method", reference.method},
                         {"uncertainty", rounded(reference.uncertainty)},
                         {"known", reference.known},
                         {"fate", reference.fate},
                         {"frames", std::max<std::size_t>(1, reference.poses.size())}};
  }
  data["glb_size"] = glb.size();
  return filled(embedded::player_html(),
                {{"title", escaped(title)},
                 {"style", std::string(embedded::player_css())},
                 {"data", for_page(data)},
                 {"bytes", base64(zlib_compressed(glb + poses, 9))},
                 {"script", fmt::format("const OPTICS = {};\nconst LOOKS = {};\n{}{}{}{}{}{}{}{}",
                                        for_page(shaders::optics_glsl), for_page(shaders::looks_glsl),
                                        embedded::recording_js(), embedded::shaders_js(),
                                        embedded::camera_js(), embedded::bodies_js(), embedded::painter_js(),
                                        embedded::strip_js(), embedded::marks_js(), embedded::player_js())}});
}

}  // namespace substep::render
