#include "render/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/math/rotation.h"

#include <glm/geometric.hpp>

namespace substep::render {
namespace {

glm::dvec3 to_glm(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

double tangent(double angle) {
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
  view.tangent_y = tangent(0.3);
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
  view.tangent_y = tangent(std::clamp(camera.vertical_field_of_view, 0.01, 3.0) / 2);
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
  constexpr double infinite = std::numeric_limits<double>::infinity();
  double low_x = infinite, high_x = -infinite, low_y = infinite, high_y = -infinite;
  const double tx = view.tangent_x / margin;
  const double ty = view.tangent_y / margin;
  const auto include = [&](const Vector3& point) {
    const glm::dvec3 p = to_glm(point);
    const double x = glm::dot(p, view.right);
    const double y = glm::dot(p, view.up);
    const double z = glm::dot(p, view.forward);
    low_x = std::min(low_x, x + z * tx);
    high_x = std::max(high_x, x - z * tx);
    low_y = std::min(low_y, y + z * ty);
    high_y = std::max(high_y, y - z * ty);
  };
  // Of a whole run, a hundred frames say where its bodies go.
  const std::size_t stride = std::max<std::size_t>(1, frames.size() / 100);
  constexpr double farthest = 1000;
  Vector3 low = Vector3::Constant(infinite);
  Vector3 high = -low;
  for (const Part& part : parts) {
    if (part.body == world_body) continue;
    for (std::size_t k = 0; k < frames.size(); k += stride) {
      const Coordinates& q = frames[k][static_cast<std::size_t>(part.body)];
      if (!(q.linear.norm() < farthest) || !q.angular.coeffs().allFinite()) continue;
      for (const Vector3& corner : part.corners()) {
        const Vector3 point = q.angular * corner + q.linear;
        include(point);
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
      }
    }
  }
  // The view holds what is near the bodies of the world: a ground that is larger would make them small.
  const Vector3 around_bodies = Vector3::Constant(low.x() < infinite ? 0.15 * (high - low).norm() : infinite);
  for (const Part& part : parts) {
    if (part.body != world_body || is_scenery(part, parts)) continue;
    const Coordinates& q = frames.front().front();
    for (const Vector3& corner : part.corners()) {
      const Vector3 point = q.angular * corner + q.linear;
      include(point.cwiseMax(low - around_bodies).cwiseMin(high + around_bodies));
    }
  }
  if (!(low_x < infinite)) {
    // Nothing to be seen: look at the origin.
    Part nothing;
    nothing.low = -Vector3::Ones();
    nothing.high = Vector3::Ones();
    for (const Vector3& corner : nothing.corners()) include(corner);
  }
  const double back = std::min((low_x - high_x) / (2 * tx), (low_y - high_y) / (2 * ty));
  view.eye = view.right * ((low_x + high_x) / 2) + view.up * ((low_y + high_y) / 2) + view.forward * back;
  return view;
}

View stepped_back(const View& view, std::span<const Part> parts,
                  std::span<const std::vector<Coordinates>> frames) {
  constexpr double margin = 1.04;
  const auto centre_of = [&](const Part& part) {
    const Coordinates& q = frames.front()[static_cast<std::size_t>(part.body)];
    return Vector3(q.angular * part.centre() + q.linear);
  };
  const auto is_shown = [&](const Vector3& point) {
    const glm::dvec3 p = to_glm(point) - view.eye;
    const double z = glm::dot(p, view.forward);
    return std::abs(glm::dot(p, view.right)) < z * view.tangent_x &&
           std::abs(glm::dot(p, view.up)) < z * view.tangent_y;
  };
  const auto is_too_long = [&](const Part& part) {
    const double distance = glm::dot(to_glm(centre_of(part)) - view.eye, view.forward);
    // As wide as a film is: a panel of another shape shows no other scene.
    const double tangent = std::max(view.tangent_x, 16.0 / 9 * view.tangent_y);
    return part.half_size().norm() > 1.25 * distance * tangent;
  };
  std::vector<const Part*> held;
  Vector3 middle = Vector3::Zero();
  for (const Part& part : parts) {
    if (is_scenery(part, parts) || is_too_long(part)) continue;
    if (part.body == world_body && !is_shown(centre_of(part))) continue;
    held.push_back(&part);
    middle += centre_of(part);
  }
  middle /= static_cast<double>(std::max<std::size_t>(1, held.size()));
  double stage = 0;
  for (const Part* part : held) {
    stage = std::max(stage, 2.5 * ((centre_of(*part) - middle).norm() + part->half_size().norm()));
  }
  // Hold the body that stays nearest to the end: no picture is empty.
  for (const std::vector<Coordinates>& frame : frames) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Part* part : held) {
      if (part->body == world_body) continue;
      const Vector3 away = frame[static_cast<std::size_t>(part->body)].linear - middle;
      nearest = std::min(nearest, away.norm() + part->centre().norm() + part->half_size().norm());
    }
    if (std::isfinite(nearest)) stage = std::max(stage, nearest);
  }
  double back = 0;
  for (const Part* part : held) {
    for (const std::vector<Coordinates>& frame : frames) {
      const Coordinates& q = frame[static_cast<std::size_t>(part->body)];
      for (const Vector3& corner : part->corners()) {
        const Vector3 point = q.angular * corner + q.linear;
        if (!((point - middle).norm() < stage)) continue;
        const glm::dvec3 p = to_glm(point) - view.eye;
        const double beside = std::max(std::abs(glm::dot(p, view.right)) / view.tangent_x,
                                       std::abs(glm::dot(p, view.up)) / view.tangent_y);
        back = std::max(back, margin * beside - glm::dot(p, view.forward));
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
