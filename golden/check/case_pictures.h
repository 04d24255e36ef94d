#pragma once
/// Draws a case's frames as the golden pictures are drawn.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "golden/suite/suite.h"
#include "render/renderer.h"
#include "sim/log/pose_log.h"

namespace substep::golden {

/// Writes a file of a case's folder, which is made where it is not there. Returns the file.
std::filesystem::path write_below(const std::filesystem::path& folder, const std::string& name,
                                  std::string_view bytes);

/// A picture with its image of bodies. Both empty where there was nothing to draw.
struct Drawing {
  render::Image picture;
  render::Image bodies;

  bool is_there() const { return !picture.rgb.empty(); }
};

/// Draws frames of one pose log.
///
/// By a renderer of its own: the run's poses set the ground and, where the scene has none, the camera, so
/// that a renderer that drew another run before would give other pictures.
class CasePainter {
 public:
  CasePainter(const Scene& scene, const SuiteCase& entry, const PoseLog& log);

  Drawing draw(std::span<const Coordinates> poses) {
    return {renderer_.draw(poses), renderer_.draw_bodies(poses)};
  }
  render::Image draw_picture(std::span<const Coordinates> poses) { return renderer_.draw(poses); }

 private:
  render::Renderer renderer_;
};

/// Returns the poses of a log's frames that have them.
std::vector<std::vector<Coordinates>> full_frames(const PoseLog& log, const Scene& scene);

}  // namespace substep::golden
