#include "render/video/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "render/text.h"
#include "sim/error.h"
#include "sim/model/joint_anchors.h"

namespace substep {
namespace {

constexpr Color gap_color{255, 60, 80};
constexpr Color anchor_color{255, 255, 255};
constexpr Color ghost_color{255, 255, 255};

Color ramp_at(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * (error_ramp.size() - 1);
  const auto index = std::min(static_cast<std::size_t>(place), error_ramp.size() - 2);
  Color color{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double from = error_ramp[index][c];
    const double to = error_ramp[index + 1][c];
    color[c] =
        static_cast<std::uint8_t>(std::lround(from + (to - from) * (place - static_cast<double>(index))));
  }
  return color;
}

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

void draw_error_colors(Image& picture, const OverlayFrame& frame) {
  std::vector<Color> colors(frame.scene.bodies.size());
  const std::vector<Coordinates>& poses = poses_of(frame);
  for (std::size_t body = 1; body < colors.size(); ++body) {
    const double error = std::sqrt(
        squared_distance(frame.scene.bodies[body], poses[body], frame.reference->poses[frame.k][body]));
    const double decades = std::log10(std::max(error, 1e-12)) - frame.lower;
    colors[body] = ramp_at(decades / (frame.upper - frame.lower));
  }
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

void draw_joints(Image& picture, const OverlayFrame& frame) {
  const std::vector<Coordinates>& poses = poses_of(frame);
  const double dot = std::max(2.0, picture.height / 90.0);
  double largest = 0;
  for (const Joint& joint : frame.scene.joints) {
    if (!holds_anchors_together(joint)) continue;
    const Vector3 a = anchor(poses[static_cast<std::size_t>(joint.body_a)], joint.frame_a);
    const Vector3 b = anchor(poses[static_cast<std::size_t>(joint.body_b)], joint.frame_b);
    largest = std::max(largest, (a - b).norm());
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
  const TextStyle style{
      .size = std::max(10.0, picture.height / 20.0), .color = {255, 255, 255}, .bold = true};
  const std::string text = fmt::format("gap {}", length_label(largest));
  const double wide = text_width(text, style);
  fill_rectangle(picture, static_cast<int>(picture.width - wide - 12),
                 static_cast<int>(picture.height - 1.5 * style.size), static_cast<int>(wide + 8),
                 static_cast<int>(1.3 * style.size), {15, 18, 24}, 0.7);
  draw_text(picture, picture.width - wide - 8, picture.height - 0.55 * style.size, text, style);
}

}  // namespace

Overlays overlays_named(const std::vector<std::string>& names) {
  Overlays overlays;
  for (const std::string& name : names) {
    if (name == "trails") {
      overlays.trails = true;
    } else if (name == "joints") {
      overlays.joints = true;
    } else if (name == "ghost") {
      overlays.ghost = true;
    } else if (name == "error") {
      overlays.error = true;
    } else {
      throw Error(fmt::format("--overlay '{}': give some of trails, joints, ghost, error", name));
    }
  }
  return overlays;
}

std::vector<KeyEntry> key_of(const Overlays& overlays, int lower, int upper) {
  constexpr Color words{146, 156, 170};
  std::vector<KeyEntry> key;
  if (overlays.trails) {
    key.emplace_back("— ", Color{200, 205, 214});
    key.emplace_back("the last second’s way    ", words);
  }
  if (overlays.joints) {
    key.emplace_back("● ", anchor_color);
    key.emplace_back("joint  ", words);
    key.emplace_back("●—● ", gap_color);
    key.emplace_back("open joint, and the largest gap    ", words);
  }
  if (overlays.ghost) {
    key.emplace_back("□ ", ghost_color);
    key.emplace_back("where the reference is    ", words);
  }
  if (overlays.error) {
    key.emplace_back(fmt::format("{} ", length_label(std::pow(10.0, lower))), words);
    for (int i = 0; i < 9; ++i) key.emplace_back("■", ramp_at(i / 8.0));
    key.emplace_back(fmt::format(" {} from the reference", length_label(std::pow(10.0, upper))), words);
  }
  return key;
}

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
  if (overlays.error && frame.reference != nullptr && frame.bodies != nullptr &&
      frame.k < frame.run.errors.size()) {
    draw_error_colors(picture, frame);
  }
  if (overlays.trails) draw_trails(picture, frame);
  if (overlays.ghost && frame.reference != nullptr && frame.reference_bodies != nullptr) {
    draw_ghost(picture, frame);
  }
  if (overlays.joints) draw_joints(picture, frame);
}

}  // namespace substep
