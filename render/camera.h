#pragma once
/// Views of a scene.

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

struct Part;

inline glm::dvec3 to_glm(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}
inline Vector3 to_eigen(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

/// A perspective view in world coordinates, m; right-handed, y up on the picture.
struct View {
  glm::dvec3 eye{0};
  glm::dvec3 right{1, 0, 0};
  glm::dvec3 up{0, 1, 0};
  glm::dvec3 forward{0, 0, -1};
  double tangent_x = 1;  ///< of half the horizontal field of view
  double tangent_y = 1;
  /// Tangents from `forward` to the picture's middle: 0 except in a part of a picture.
  double shift_x = 0;
  double shift_y = 0;

  bool operator==(const View&) const = default;
};

/// Returns the view of a part of a picture of width × height pixels: part_width × part_height pixels whose
/// upper left corner is the picture's pixel (x, y).
View part_of(const View& view, int width, int height, int x, int y, int part_width, int part_height);

/// Returns the view of a scene's camera. `aspect` is width / height.
View view_from(const Camera& camera, double aspect);

/// Returns a three-quarter view from slightly above that holds all moving parts at all the given frames'
/// poses, and parts of the world near them, except scenery. Ignores bodies that cannot be drawn or that moved
/// both 1 km and ten times the scene's size.
View automatic_view(std::span<const Part> parts, std::span<const std::vector<Coordinates>> frames,
                    double aspect);

/// Returns the view moved back until it holds all moving parts at the given frames' poses, and those parts of
/// the world whose middle `view` shows. Ignores points that leave the scene (2.5 times its extent at the
/// first frame) and parts 1.25 times as wide as a 16:9 picture at their distance: belts, ground plates.
View stepped_back(const View& view, std::span<const Part> parts,
                  std::span<const std::vector<Coordinates>> frames);

/// Returns the map from world to clip space, with depths from `near` to `far`, m, in front of the eye.
glm::dmat4 clip_from_world(const View& view, double near, double far);

}  // namespace substep::render
