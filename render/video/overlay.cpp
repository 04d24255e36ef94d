#include "render/video/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "render/text.h"
#include "render/video/film_camera.h"
#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/measure/motion.h"
#include "sim/model/model.h"

namespace substep::render {
namespace {

/// The body at a pixel of Renderer::draw_bodies; -1: the sky.
int body_at(const Image& bodies, int x, int y) {
  const std::uint8_t* const p = bodies.pixel(x, y);
  return p[0] + 256 * p[1] + 65536 * p[2] - 1;
}

bool moves(const Scene& scene, std::size_t body) {
  return body > 0 && body < scene.bodies.size() && scene.bodies[body].inverse_mass > 0;
}

Vector3 anchor(const Coordinates& q, const Pose& frame) {
  return q.angular * frame.position + q.linear;
}

const std::vector<Coordinates>& poses_of(const OverlayFrame& frame) {
  return frame.run.poses[std::min(frame.k, frame.run.poses.size() - 1)];
}

Color tint_of(double value, const OverlayScales& scales) {
  if (!scales.is_logarithmic) return ramp_at((value - scales.low) / (scales.high - scales.low));
  return ramp_at(std::log10(std::max(value, 1e-12) / scales.low) / std::log10(scales.high / scales.low));
}

/// What colours each body at the frame; nothing where that is not known.
std::vector<double> tint_values(const Overlays& overlays, const OverlayFrame& frame) {
  std::vector<double> values;
  const auto of_frame = [&](const std::vector<std::vector<float>>& all) {
    if (all.empty()) return;
    const std::vector<float>& at = all[std::min(frame.k, all.size() - 1)];
    values.assign(at.begin(), at.end());
  };
  if (overlays.tint == Overlays::Tint::velocity) of_frame(frame.run.readings.speeds);
  if (overlays.tint == Overlays::Tint::penetration) of_frame(frame.run.readings.depths);
  if (overlays.tint == Overlays::Tint::error && frame.reference != nullptr &&
      frame.k < frame.run.errors.size()) {
    const std::vector<Coordinates>& poses = poses_of(frame);
    values.reserve(poses.size());
    for (std::size_t body = 0; body < poses.size(); ++body) {
      values.push_back(std::sqrt(
          squared_distance(frame.scene.bodies[body], poses[body], frame.reference->poses[frame.k][body])));
    }
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
      if (body < 1 || !moves(frame.scene, static_cast<std::size_t>(body))) continue;
      std::uint8_t* const p = picture.pixel(x, y);
      // The shading stays, the body's own colour goes.
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
      bool is_edge = false;
      for (const int other :
           {body_at(*frame.reference_bodies, x + 1, y), body_at(*frame.reference_bodies, x, y + 1)}) {
        is_edge = is_edge ||
                  (here != other && ((here > 0 && moves(frame.scene, static_cast<std::size_t>(here))) ||
                                     (other > 0 && moves(frame.scene, static_cast<std::size_t>(other)))));
      }
      if (is_edge) fill_rectangle(picture, x, y, thick, thick, ghost_color, 0.85);
    }
  }
}

void draw_trails(Image& picture, const OverlayFrame& frame) {
  const Color color = accent(frame.run.panel);
  const std::size_t end = std::min(frame.k, frame.run.poses.size() - 1);
  const std::size_t begin = end > frame.trail ? end - frame.trail : 0;
  const double width = std::max(1.0, picture.height / 200.0);
  for (std::size_t body = 1; body < frame.scene.bodies.size(); ++body) {
    if (!moves(frame.scene, body)) continue;
    for (std::size_t k = begin; k < end; ++k) {
      double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
      if (!project(frame.view, frame.run.poses[k][body].linear, picture.width, picture.height, x0, y0) ||
          !project(frame.view, frame.run.poses[k + 1][body].linear, picture.width, picture.height, x1, y1)) {
        continue;
      }
      const double age = static_cast<double>(end - k) / static_cast<double>(frame.trail);
      draw_line(picture, x0, y0, x1, y1, width, color, 0.9 * (1 - age));
    }
  }
}

/// Size of text in a picture, pixels.
double label_size(const Image& picture) {
  return std::max(10.0, std::min(picture.height / 20.0, picture.width / 26.0));
}

void draw_joints(Image& picture, const OverlayFrame& frame) {
  const std::vector<Coordinates>& poses = poses_of(frame);
  const double dot = std::max(2.0, picture.height / 90.0);
  for (const Joint& joint : frame.scene.joints) {
    if (!holds_anchors_together(joint)) continue;
    const Vector3 a = anchor(poses[static_cast<std::size_t>(joint.body_a)], joint.frame_a);
    const Vector3 b = anchor(poses[static_cast<std::size_t>(joint.body_b)], joint.frame_b);
    double xa = 0, ya = 0, xb = 0, yb = 0;
    if (!project(frame.view, a, picture.width, picture.height, xa, ya) ||
        !project(frame.view, b, picture.width, picture.height, xb, yb)) {
      continue;
    }
    const bool is_open = std::hypot(xb - xa, yb - ya) > 1.5;
    if (is_open) draw_line(picture, xa, ya, xb, yb, 0.5 * dot, gap_color);
    for (const auto& [x, y] : {std::pair(xa, ya), std::pair(xb, yb)}) {
      draw_line(picture, x, y, x, y, dot + 2, {20, 20, 20});
      draw_line(picture, x, y, x, y, dot, is_open ? gap_color : anchor_color);
    }
  }
  // Poses between two steps are interpolated, and would show gaps of their own.
  const std::vector<double>& gaps = frame.run.readings.gaps;
  if (gaps.empty()) return;
  const TextStyle style{.size = label_size(picture), .color = {255, 255, 255}, .bold = true};
  const std::string text = fmt::format("gap {}", length_label(gaps[std::min(frame.k, gaps.size() - 1)]));
  const double wide = text_width(text, style);
  fill_rectangle(picture, static_cast<int>(picture.width - wide - 12),
                 static_cast<int>(picture.height - 1.5 * style.size), static_cast<int>(wide + 8),
                 static_cast<int>(1.3 * style.size), {15, 18, 24}, 0.7);
  draw_text(picture, picture.width - wide - 8, picture.height - 0.55 * style.size, text, style);
}

/// Returns the largest of 1, 2, 5, 10, … that is not above a value.
double round_down(double value) {
  const double ten = std::pow(10.0, std::floor(std::log10(value)));
  return value >= 5 * ten ? 5 * ten : value >= 2 * ten ? 2 * ten : ten;
}

/// A line that ends in a point.
void draw_arrow(Image& picture, double x0, double y0, double x1, double y1, double barb_length, double width,
                const Color& color) {
  draw_line(picture, x0, y0, x1, y1, width, color);
  const double length = std::hypot(x1 - x0, y1 - y0);
  if (!(length > 0.5 * barb_length)) return;
  const double along_x = (x1 - x0) / length;
  const double along_y = (y1 - y0) / length;
  const double barb = std::min(barb_length, 0.5 * length);
  for (const double side : {-0.5, 0.5}) {
    draw_line(picture, x1, y1, x1 - barb * (along_x + side * along_y), y1 - barb * (along_y - side * along_x),
              width, color);
  }
}

/// Draws an arrow of a round impulse in the lower left corner, as long as it is in the scene's middle.
void draw_impulse_scale(Image& picture, const OverlayFrame& frame) {
  const glm::dvec3& eye = frame.view.eye;
  const glm::dvec3& ahead = frame.view.forward;
  const Vector3 to_middle = middle_of(frame.scene) - Vector3(eye.x, eye.y, eye.z);
  const double depth = to_middle.dot(Vector3(ahead.x, ahead.y, ahead.z));
  if (!(depth > 0)) return;
  const double pixels = frame.scales.metres_per_impulse * picture.height / (2 * frame.view.tangent_y * depth);
  const double impulse = round_down(0.2 * picture.width / pixels);
  const double length = pixels * impulse;
  const TextStyle style{.size = label_size(picture), .color = {255, 255, 255}, .bold = true};
  const std::string text = fmt::format("{:g} N·s", impulse);
  const double width = std::max(1.5, picture.height / 180.0);
  const double y = picture.height - 0.9 * style.size;
  fill_rectangle(picture, 4, static_cast<int>(picture.height - 1.5 * style.size),
                 static_cast<int>(length + text_width(text, style) + 20), static_cast<int>(1.3 * style.size),
                 {15, 18, 24}, 0.7);
  draw_arrow(picture, 8, y, 8 + length, y, 3.5 * width, width, arrow_color);
  draw_text(picture, 16 + length, picture.height - 0.55 * style.size, text, style);
}

void draw_contacts(Image& picture, const OverlayFrame& frame) {
  const auto& contacts = frame.run.readings.contacts;
  if (contacts.empty()) return;
  draw_impulse_scale(picture, frame);
  const double width = std::max(1.5, picture.height / 180.0);
  const double dot = std::max(3.0, picture.height / 80.0);
  constexpr Color dark{20, 20, 20};
  for (const ContactImpulse& contact : contacts[std::min(frame.k, contacts.size() - 1)]) {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    const Vector3 tip = contact.place + frame.scales.metres_per_impulse * contact.impulse;
    if (!project(frame.view, contact.place, picture.width, picture.height, x0, y0)) continue;
    const bool is_idle = contact.impulse.isZero();
    if (!is_idle && project(frame.view, tip, picture.width, picture.height, x1, y1)) {
      draw_arrow(picture, x0, y0, x1, y1, 3.5 * width, width + 2, dark);
      draw_arrow(picture, x0, y0, x1, y1, 3.5 * width, width, arrow_color);
    }
    const double size = is_idle ? 0.6 * dot : dot;
    draw_line(picture, x0, y0, x0, y0, size + 2, dark);
    draw_line(picture, x0, y0, x0, y0, size, is_idle ? idle_color : arrow_color);
  }
}

}  // namespace

bool project(const View& view, const Vector3& point, int width, int height, double& x, double& y) {
  const glm::dvec3 p = glm::dvec3(point.x(), point.y(), point.z()) - view.eye;
  const double ahead = glm::dot(p, view.forward);
  if (!(ahead > 1e-3)) return false;
  x = width * (0.5 + 0.5 * glm::dot(p, view.right) / (ahead * view.tangent_x));
  y = height * (0.5 - 0.5 * glm::dot(p, view.up) / (ahead * view.tangent_y));
  // Far outside, a line would run through the picture for nothing but rounding.
  return std::abs(x) < 1e5 && std::abs(y) < 1e5;
}

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

void draw_departure(Image& picture, const Departure& departure, const OverlayFrame& frame) {
  const auto body = static_cast<std::size_t>(departure.body);
  const Coordinates& q = poses_of(frame)[body];
  double x = 0, y = 0, beside = 0, ignored = 0;
  // As large as the body seems, by its moments of inertia.
  const Body& of = frame.scene.bodies[body];
  const double inertia = of.inverse_inertia.minCoeff() > 0 ? 1 / of.inverse_inertia.minCoeff() : 0;
  const double size = 1.8 * std::sqrt(inertia * of.inverse_mass) + 0.02;
  const Vector3 right(frame.view.right.x, frame.view.right.y, frame.view.right.z);
  if (!project(frame.view, q.linear, picture.width, picture.height, x, y) ||
      !project(frame.view, q.linear + size * right, picture.width, picture.height, beside, ignored)) {
    return;
  }
  const double radius = std::clamp(beside - x, picture.height / 18.0, picture.height / 3.0);
  const double width = std::max(2.0, picture.height / 120.0);
  constexpr int corners = 48;
  for (const auto& [wide, color] : {std::pair(width + 2, Color{20, 20, 20}), std::pair(width, gap_color)}) {
    for (int i = 0; i < corners; ++i) {
      const SineCosine from = sine_cosine(2 * std::numbers::pi * i / corners);
      const SineCosine to = sine_cosine(2 * std::numbers::pi * (i + 1) / corners);
      draw_line(picture, x + radius * from.cosine, y + radius * from.sine, x + radius * to.cosine,
                y + radius * to.sine, wide, color);
    }
  }
  TextStyle style{.size = std::max(11.0, picture.height / 18.0), .color = {255, 255, 255}, .bold = true};
  const std::string text = fmt::format("{} off", length_label(departure.distance));
  while (style.size > 8 && text_width(text, style) > picture.width - 12) style.size *= 0.95;
  const double wide = text_width(text, style);
  const double left = std::clamp(x - wide / 2, 4.0, std::max(4.0, picture.width - wide - 4));
  const double below = y + radius + 1.4 * style.size;
  const double base = below < picture.height - 4 ? below : y - radius - 0.6 * style.size;
  fill_rectangle(picture, static_cast<int>(left - 4), static_cast<int>(base - style.size),
                 static_cast<int>(wide + 8), static_cast<int>(1.35 * style.size), {15, 18, 24}, 0.7);
  draw_text(picture, left, base, text, style);
}

}  // namespace substep::render
