#include "render/camera.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "render/body_mesh.h"
#include "sim/math/rotation.h"

namespace substep::render {
namespace {

/// Returns a vector's components to the right, upwards and ahead.
glm::dvec3 along_axes(const View& view, const glm::dvec3& p) {
  return {glm::dot(p, view.right), glm::dot(p, view.up), glm::dot(p, view.forward)};
}

double tangent_of(double angle) {
  const SineCosine of = sine_cosine(angle);
  return of.sine / of.cosine;
}

/// Returns the direction and width of automatic_view().
View view_from_above(double aspect) {
  constexpr double azimuth = 0.55;    // from +Z towards +X
  constexpr double elevation = 0.25;  // rad
  View view;
  const SineCosine around = sine_cosine(azimuth);
  const SineCosine above = sine_cosine(elevation);
  view.forward = -glm::dvec3(around.sine * above.cosine, above.sine, around.cosine * above.cosine);
  view.right = glm::normalize(glm::cross(view.forward, glm::dvec3(0, 1, 0)));
  view.up = glm::cross(view.right, view.forward);
  view.tangent_y = tangent_of(0.3);
  view.tangent_x = view.tangent_y * aspect;
  return view;
}

}  // namespace

View view_from(const Camera& camera, double aspect) {
  View view;
  view.eye = to_glm(camera.pose.position);
  view.right = to_glm(camera.pose.orientation * Vector3::UnitX());
  view.up = to_glm(camera.pose.orientation * Vector3::UnitY());
  view.forward = to_glm(camera.pose.orientation * -Vector3::UnitZ());
  view.tangent_y = tangent_of(std::clamp(camera.vertical_field_of_view, 0.01, 3.0) / 2);
  view.tangent_x = view.tangent_y * aspect;
  return view;
}

View part_of(const View& view, int width, int height, int x, int y, int part_width, int part_height) {
  View part = view;
  part.tangent_x = view.tangent_x * part_width / width;
  part.tangent_y = view.tangent_y * part_height / height;
  part.shift_x = view.shift_x + view.tangent_x * (2.0 * x + part_width - width) / width;
  part.shift_y = view.shift_y - view.tangent_y * (2.0 * y + part_height - height) / height;
  return part;
}

View automatic_view(std::span<const Part> parts, std::span<const std::vector<Coordinates>> frames,
                    double aspect) {
  constexpr double margin = 1.12;
  View view = view_from_above(aspect);

  // A point x to the right and z ahead of the origin is seen from an eye at (ex, ez) when
  // |x − ex| <= (z − ez) tx: ex − ez tx >= x − z tx and ex + ez tx <= x + z tx. Both extremes over all points
  // meet in the nearest eye; likewise for y, and the farther of both eyes sees all.
  const glm::dvec2 tangents = glm::dvec2(view.tangent_x, view.tangent_y) / margin;
  glm::dvec2 low_eye(infinity);
  glm::dvec2 high_eye(-infinity);
  const auto include = [&](const Vector3& point) {
    const glm::dvec3 p = along_axes(view, to_glm(point));
    low_eye = glm::min(low_eye, glm::dvec2(p) + p.z * tangents);
    high_eye = glm::max(high_eye, glm::dvec2(p) - p.z * tangents);
  };
  // At least a hundred frames of a run show where its bodies go.
  const std::size_t stride = std::max<std::size_t>(1, frames.size() / 100);
  double farthest = infinity;  // from a body's first position, m
  Vector3 low = Vector3::Constant(infinity);
  Vector3 high = -low;
  for (std::size_t k = 0; k < frames.size(); k += stride) {
    for (const Part& part : parts) {
      const Coordinates& q = frames[k][part.body];
      const double moved = (q.linear - frames.front()[part.body].linear).norm();
      if (part.body == world_body || !is_drawable(q) || !(moved < farthest)) continue;
      for (const Vector3& point : part.corners_at(q)) {
        include(point);
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
      }
    }
    if (k == 0) farthest = std::max(1000.0, 10 * (high - low).norm());
  }
  // Hold only those parts of the world that are near moving bodies: a whole ground would make these small.
  const Vector3 around_bodies = Vector3::Constant(low.x() < infinity ? 0.15 * (high - low).norm() : infinity);
  for (const Part& part : parts) {
    if (part.body != world_body || is_scenery(part, parts)) continue;
    for (const Vector3& point : part.corners_at(frames.front().front())) {
      include(point.cwiseMax(low - around_bodies).cwiseMin(high + around_bodies));
    }
  }
  if (!(low_eye.x < infinity)) {
    // Look at the origin of an empty scene.
    const Part nothing{.low = -Vector3::Ones(), .high = Vector3::Ones()};
    for (const Vector3& corner : nothing.corners_at({})) include(corner);
  }
  const glm::dvec2 backs = (low_eye - high_eye) / (2.0 * tangents);
  const glm::dvec2 middle = (low_eye + high_eye) / 2.0;
  view.eye = view.right * middle.x + view.up * middle.y + view.forward * std::min(backs.x, backs.y);
  return view;
}

View stepped_back(const View& view, std::span<const Part> parts,
                  std::span<const std::vector<Coordinates>> frames) {
  constexpr double margin = 1.04;
  const auto centre_of = [&](const Part& part) {
    const Coordinates& q = frames.front()[part.body];
    return Vector3(q.angular * part.centre() + q.linear);
  };
  const auto seen_at = [&](const Vector3& point) { return along_axes(view, to_glm(point) - view.eye); };
  const auto is_shown = [&](const glm::dvec3& p) {
    return std::abs(p.x) < p.z * view.tangent_x && std::abs(p.y) < p.z * view.tangent_y;
  };
  // Take a film's width: a panel of another shape shows the same scene.
  const double widest = std::max(view.tangent_x, 16.0 / 9 * view.tangent_y);
  std::vector<const Part*> held;
  Vector3 middle = Vector3::Zero();
  for (const Part& part : parts) {
    const glm::dvec3 seen = seen_at(centre_of(part));
    const bool is_too_long = part.half_size().norm() > 1.25 * seen.z * widest;
    if (is_scenery(part, parts) || is_too_long || (part.body == world_body && !is_shown(seen))) continue;
    held.push_back(&part);
    middle += centre_of(part);
  }
  middle /= static_cast<double>(std::max<std::size_t>(1, held.size()));
  double stage = 0;  // radius of a ball about the middle, beyond which nothing is held
  for (const Part* part : held) {
    stage = std::max(stage, 2.5 * ((centre_of(*part) - middle).norm() + part->half_size().norm()));
  }
  // Widen the stage to the nearest body of each frame, so that no picture is empty.
  for (const std::vector<Coordinates>& frame : frames) {
    double nearest = infinity;
    for (const Part* part : held) {
      if (part->body == world_body) continue;
      const Vector3 away = frame[part->body].linear - middle;
      nearest = std::min(nearest, away.norm() + part->centre().norm() + part->half_size().norm());
    }
    if (std::isfinite(nearest)) stage = std::max(stage, nearest);
  }
  double back = 0;
  for (const Part* part : held) {
    for (const std::vector<Coordinates>& frame : frames) {
      for (const Vector3& point : part->corners_at(frame[part->body])) {
        if (!((point - middle).norm() < stage)) continue;
        const glm::dvec3 p = seen_at(point);
        const double beside = std::max(std::abs(p.x) / view.tangent_x, std::abs(p.y) / view.tangent_y);
        back = std::max(back, margin * beside - p.z);
      }
      if (part->body == world_body) break;
    }
  }
  View result = view;
  result.eye -= view.forward * back;
  return result;
}

glm::dmat4 clip_from_world(const View& view, double near, double far) {
  glm::dmat4 eye_from_world(1);
  const glm::dvec3 axes[3] = {view.right, view.up, -view.forward};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) eye_from_world[column][row] = axes[row][column];
    eye_from_world[3][row] = -glm::dot(axes[row], view.eye);
  }
  glm::dmat4 projection(0);
  projection[0][0] = 1 / view.tangent_x;
  projection[1][1] = 1 / view.tangent_y;
  projection[2][0] = view.shift_x / view.tangent_x;
  projection[2][1] = view.shift_y / view.tangent_y;
  projection[2][2] = -(far + near) / (far - near);
  projection[2][3] = -1;
  projection[3][2] = -2 * far * near / (far - near);
  return projection * eye_from_world;
}

}  // namespace substep::render
