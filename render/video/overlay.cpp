#include "render/video/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "render/text.h"
#include "render/video/film_camera.h"
#include "render/video/titles.h"
#include "sim/math/rotation.h"
#include "sim/model/model.h"

namespace substep::render {
namespace {

using namespace overlay_colors;

constexpr Color dark{20, 20, 20};

/// Returns the largest of 1, 2, 5, 10, … that is not above a value.
double round_down(double value) {
  const double ten = std::pow(10.0, std::floor(std::log10(value)));
  return value >= 5 * ten ? 5 * ten : value >= 2 * ten ? 2 * ten : ten;
}

/// Returns the values of a frame, or of the last frame before it that has values.
template <typename Value>
const Value& at_frame(const std::vector<Value>& frames, std::size_t k) {
  return frames[std::min(k, frames.size() - 1)];
}

/// Returns the body at a pixel of Renderer::draw_bodies; −1: the sky.
int body_at(const Image& bodies, int x, int y) {
  const std::uint8_t* const p = bodies.pixel(x, y);
  return p[0] + 256 * p[1] + 65536 * p[2] - 1;
}

/// Returns whether a body is dynamic. The world and the sky are not.
bool moves(const Scene& scene, int body) {
  return body > 0 && body < static_cast<int>(scene.bodies.size()) &&
         scene.bodies[static_cast<std::size_t>(body)].inverse_mass > 0;
}

using Pixel = std::array<double, 2>;

std::optional<Pixel> projected(const Image& picture, const OverlayFrame& frame, const Vector3& point) {
  return project(frame.view, point, picture.width, picture.height);
}

void draw_line(Image& picture, const Pixel& from, const Pixel& to, double width, const Color& color,
               double alpha = 1) {
  draw_line(picture, from[0], from[1], to[0], to[1], width, color, alpha);
}

/// Draws a dot with a dark rim.
void draw_dot(Image& picture, const Pixel& at, double size, const Color& color) {
  draw_line(picture, at, at, size + 2, dark);
  draw_line(picture, at, at, size, color);
}

/// Draws a dark rectangle behind text.
void draw_plate(Image& picture, double x, double y, double width, double height) {
  fill_rectangle(picture, static_cast<int>(x), static_cast<int>(y), static_cast<int>(width),
                 static_cast<int>(height), film_colors::ground, 0.7);
}

Color tint_of(double value, const OverlayScales& scales) {
  if (!scales.is_logarithmic) return ramp_at((value - scales.low) / (scales.high - scales.low));
  return ramp_at(std::log10(std::max(value, 1e-12) / scales.low) / std::log10(scales.high / scales.low));
}

/// Returns the quantity that colours each body at the frame; nothing where it is not known.
std::vector<double> tint_values(const Overlays& overlays, const OverlayFrame& frame) {
  std::vector<double> values;
  const FrameQuantities& quantities = frame.run.quantities;
  if (overlays.tint == Overlays::Tint::error) {
    if (frame.reference == nullptr || frame.k >= frame.run.errors.size()) return values;
    const std::vector<Coordinates>& poses = at_frame(frame.run.poses, frame.k);
    for (std::size_t body = 0; body < poses.size(); ++body) {
      values.push_back(std::sqrt(
          squared_distance(frame.scene.bodies[body], poses[body], frame.reference->poses[frame.k][body])));
    }
  } else if (overlays.tint != Overlays::Tint::none) {
    const auto& frames = overlays.tint == Overlays::Tint::speed ? quantities.speeds : quantities.depths;
    if (!frames.empty()) values.assign(at_frame(frames, frame.k).begin(), at_frame(frames, frame.k).end());
  }
  return values;
}

void draw_tint(Image& picture, const std::vector<double>& values, const OverlayFrame& frame) {
  std::vector<Color> colors;
  colors.reserve(values.size());
  for (const double value : values) colors.push_back(tint_of(value, frame.scales));
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const int body = body_at(*frame.bodies, x, y);
      if (!moves(frame.scene, body)) continue;
      // Keep the shading and replace the colour.
      std::uint8_t* const p = picture.pixel(x, y);
      const int light = 100 + (p[0] + p[1] + p[2]) / 3;
      for (std::size_t c = 0; c < 3; ++c) {
        const int value = colors[static_cast<std::size_t>(body)][c] * light / 200;
        p[c] = static_cast<std::uint8_t>(std::min(255, value));
      }
    }
  }
}

void draw_ghost(Image& picture, const OverlayFrame& frame) {
  const int thick = std::max(1, picture.height / 300);
  for (int y = 0; y + 1 < picture.height; ++y) {
    for (int x = 0; x + 1 < picture.width; ++x) {
      const int here = body_at(*frame.reference_bodies, x, y);
      const auto is_edge_to = [&](int other) {
        return here != other && (moves(frame.scene, here) || moves(frame.scene, other));
      };
      if (is_edge_to(body_at(*frame.reference_bodies, x + 1, y)) ||
          is_edge_to(body_at(*frame.reference_bodies, x, y + 1))) {
        fill_rectangle(picture, x, y, thick, thick, white, 0.85);
      }
    }
  }
}

void draw_trails(Image& picture, const OverlayFrame& frame) {
  const Color color = accent(frame.run.panel);
  const std::size_t end = std::min(frame.k, frame.run.poses.size() - 1);
  const std::size_t begin = end > frame.trail ? end - frame.trail : 0;
  const double width = std::max(1.0, picture.height / 200.0);
  for (std::size_t body = 1; body < frame.scene.bodies.size(); ++body) {
    if (!moves(frame.scene, static_cast<int>(body))) continue;
    for (std::size_t k = begin; k < end; ++k) {
      const auto from = projected(picture, frame, frame.run.poses[k][body].linear);
      const auto to = projected(picture, frame, frame.run.poses[k + 1][body].linear);
      if (!from || !to) continue;
      const double age = static_cast<double>(end - k) / static_cast<double>(frame.trail);
      draw_line(picture, *from, *to, width, color, 0.9 * (1 - age));
    }
  }
}

/// Returns the style of text in a picture.
TextStyle label_style(const Image& picture) {
  return {.size = std::max(10.0, std::min(picture.height / 20.0, picture.width / 26.0)),
          .color = white,
          .bold = true};
}

void draw_joints(Image& picture, const OverlayFrame& frame) {
  const std::vector<Coordinates>& poses = at_frame(frame.run.poses, frame.k);
  const double dot = std::max(2.0, picture.height / 90.0);
  const auto anchor = [&](int body, const Pose& joint_frame) {
    const Coordinates& q = poses[static_cast<std::size_t>(body)];
    return projected(picture, frame, q.angular * joint_frame.position + q.linear);
  };
  for (const Joint& joint : frame.scene.joints) {
    if (!holds_anchors_together(joint)) continue;
    const auto a = anchor(joint.body_a, joint.frame_a);
    const auto b = anchor(joint.body_b, joint.frame_b);
    if (!a || !b) continue;
    const bool is_open = std::hypot((*b)[0] - (*a)[0], (*b)[1] - (*a)[1]) > 1.5;
    if (is_open) draw_line(picture, *a, *b, 0.5 * dot, gap_color);
    for (const auto& at : {*a, *b}) draw_dot(picture, at, dot, is_open ? gap_color : white);
  }
  // Write the gap that was read: poses between two steps are interpolated, and open further.
  const std::vector<double>& gaps = frame.run.quantities.gaps;
  if (gaps.empty()) return;
  const TextStyle style = label_style(picture);
  const std::string text = fmt::format("gap {}", length_label(at_frame(gaps, frame.k)));
  const double wide = text_width(text, style);
  draw_plate(picture, picture.width - wide - 12, picture.height - 1.5 * style.size, wide + 8,
             1.3 * style.size);
  draw_text(picture, picture.width - wide - 8, picture.height - 0.55 * style.size, text, style);
}

/// Draws an arrow with barbs of 3.5 `barb_width`.
void draw_arrow(Image& picture, const Pixel& from, const Pixel& to, double barb_width, double width,
                const Color& color) {
  draw_line(picture, from, to, width, color);
  const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
  const double barb_length = 3.5 * barb_width;
  if (!(length > 0.5 * barb_length)) return;
  const double along_x = (to[0] - from[0]) / length;
  const double along_y = (to[1] - from[1]) / length;
  const double barb = std::min(barb_length, 0.5 * length);
  for (const double side : {-0.5, 0.5}) {
    draw_line(picture, to,
              {to[0] - barb * (along_x + side * along_y), to[1] - barb * (along_y - side * along_x)}, width,
              color);
  }
}

/// Draws an arrow of a round impulse in the lower left corner, as long as it is in the scene's middle.
void draw_impulse_scale(Image& picture, const OverlayFrame& frame, double width) {
  const glm::dvec3& eye = frame.view.eye;
  const glm::dvec3& ahead = frame.view.forward;
  const Vector3 to_middle = middle_of(frame.scene) - Vector3(eye.x, eye.y, eye.z);
  const double depth = to_middle.dot(Vector3(ahead.x, ahead.y, ahead.z));
  if (!(depth > 0)) return;
  const double pixels = frame.scales.metres_per_impulse * picture.height / (2 * frame.view.tangent_y * depth);
  const double impulse = round_down(0.2 * picture.width / pixels);
  const double length = pixels * impulse;
  const TextStyle style = label_style(picture);
  const std::string text = fmt::format("{:g} N·s", impulse);
  const double y = picture.height - 0.9 * style.size;
  draw_plate(picture, 4, picture.height - 1.5 * style.size, length + text_width(text, style) + 20,
             1.3 * style.size);
  draw_arrow(picture, {8, y}, {8 + length, y}, width, width, arrow_color);
  draw_text(picture, 16 + length, picture.height - 0.55 * style.size, text, style);
}

void draw_contacts(Image& picture, const OverlayFrame& frame) {
  const auto& contacts = frame.run.quantities.contacts;
  if (contacts.empty()) return;
  const double width = std::max(1.5, picture.height / 180.0);
  const double dot = std::max(3.0, picture.height / 80.0);
  draw_impulse_scale(picture, frame, width);
  for (const ContactImpulse& contact : at_frame(contacts, frame.k)) {
    const auto from = projected(picture, frame, contact.point);
    if (!from) continue;
    const bool is_idle = contact.impulse.isZero();
    const auto tip =
        projected(picture, frame, contact.point + frame.scales.metres_per_impulse * contact.impulse);
    if (!is_idle && tip) {
      draw_arrow(picture, *from, *tip, width, width + 2, dark);
      draw_arrow(picture, *from, *tip, width, width, arrow_color);
    }
    draw_dot(picture, *from, is_idle ? 0.6 * dot : dot, is_idle ? idle_color : arrow_color);
  }
}

}  // namespace

void draw_overlays(Image& picture, const Overlays& overlays, const OverlayFrame& frame) {
  if (frame.run.poses.empty()) return;
  if (frame.bodies != nullptr) {
    const std::vector<double> values = tint_values(overlays, frame);
    if (!values.empty()) draw_tint(picture, values, frame);
  }
  if (overlays.trails) draw_trails(picture, frame);
  if (overlays.ghost && frame.reference != nullptr && frame.reference_bodies != nullptr) {
    draw_ghost(picture, frame);
  }
  if (overlays.joints) draw_joints(picture, frame);
  if (overlays.contacts) draw_contacts(picture, frame);
}

void draw_divergence(Image& picture, int diverged, const OverlayFrame& frame) {
  const auto index = static_cast<std::size_t>(diverged);
  const Coordinates& pose = at_frame(frame.run.poses, frame.k)[index];
  const Vector3& position = pose.linear;
  // Draw a ring of the body's apparent size, by its moments of inertia.
  const Body& body = frame.scene.bodies[index];
  const double inertia = body.inverse_inertia.minCoeff() > 0 ? 1 / body.inverse_inertia.minCoeff() : 0;
  const double size = 1.8 * std::sqrt(inertia * body.inverse_mass) + 0.02;
  const Vector3 right(frame.view.right.x, frame.view.right.y, frame.view.right.z);
  const auto centre = projected(picture, frame, position);
  const auto beside = projected(picture, frame, position + size * right);
  if (!centre || !beside) return;
  const auto [x, y] = *centre;
  const double radius = std::clamp((*beside)[0] - x, picture.height / 18.0, picture.height / 3.0);
  const double width = std::max(2.0, picture.height / 120.0);
  constexpr int corners = 48;
  for (const auto& [wide, color] : {std::pair(width + 2, dark), std::pair(width, gap_color)}) {
    for (int i = 0; i < corners; ++i) {
      const SineCosine from = sine_cosine(2 * std::numbers::pi * i / corners);
      const SineCosine to = sine_cosine(2 * std::numbers::pi * (i + 1) / corners);
      draw_line(picture, {x + radius * from.cosine, y + radius * from.sine},
                {x + radius * to.cosine, y + radius * to.sine}, wide, color);
    }
  }
  // Write the distance below the ring, or above where there is no room.
  TextStyle style{.size = std::max(11.0, picture.height / 18.0), .color = white, .bold = true};
  const double distance = std::sqrt(squared_distance(body, pose, frame.reference->poses[frame.k][index]));
  const std::string text = fmt::format("{} off", length_label(distance));
  while (style.size > 8 && text_width(text, style) > picture.width - 12) style.size *= 0.95;
  const double wide = text_width(text, style);
  const double left = std::clamp(x - wide / 2, 4.0, std::max(4.0, picture.width - wide - 4));
  const double below = y + radius + 1.4 * style.size;
  const double base = below < picture.height - 4 ? below : y - radius - 0.6 * style.size;
  draw_plate(picture, left - 4, base - style.size, wide + 8, 1.35 * style.size);
  draw_text(picture, left, base, text, style);
}

std::optional<std::array<double, 2>> project(const View& view, const Vector3& point, int width, int height) {
  const glm::dvec3 p = glm::dvec3(point.x(), point.y(), point.z()) - view.eye;
  const double ahead = glm::dot(p, view.forward);
  if (!(ahead > 1e-3)) return std::nullopt;
  const double x = width * (0.5 + 0.5 * glm::dot(p, view.right) / (ahead * view.tangent_x));
  const double y = height * (0.5 - 0.5 * glm::dot(p, view.up) / (ahead * view.tangent_y));
  // Reject points far outside: rounding alone would make a line to them cross the picture.
  if (!(std::abs(x) < 1e5 && std::abs(y) < 1e5)) return std::nullopt;
  return std::array{x, y};
}

}  // namespace substep::render
