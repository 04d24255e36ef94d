#pragma once
/// The pictures of a case: drawn, compared, and left for a person to see.

#include <memory>
#include <vector>

#include "golden/check/check.h"
#include "render/renderer.h"

namespace substep::golden {

/// Writes whatever a check leaves in a case's folder.
class CaseFolder {
 public:
  explicit CaseFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// What a run before left here would be taken for this one's.
  void clear() const;
  std::filesystem::path write(const std::string& file_name, std::string_view bytes) const;

 private:
  std::filesystem::path folder_;
};

/// A picture with its image of bodies. Both empty where there was nothing to draw.
struct Drawing {
  render::Image picture;
  render::Image bodies;

  bool is_there() const { return !picture.rgb.empty(); }
};

/// Draws frames of a pose log as the golden pictures are drawn.
///
/// By a renderer of its own: what it is told of the run's poses sets the ground and, where the scene has
/// none, the camera, so that one that drew another run before would give other pictures.
class CasePainter {
 public:
  CasePainter(const Scene& scene, const SuiteCase& entry, const PoseLog& log);

  Drawing draw(std::span<const Coordinates> poses);
  render::Image draw_picture(std::span<const Coordinates> poses) { return renderer_.draw(poses); }

 private:
  render::Renderer renderer_;
};

/// The poses of a log's frames that have them.
std::vector<std::vector<Coordinates>> full_frames(const PoseLog& log, const Scene& scene);

/// How the case's pictures look onto the scene.
Viewfinder viewfinder(const Scene& scene, const SuiteCase& entry, const PoseLog& log);

/// Compares, and finds whom to blame.
PictureComparison compare_pictures(const Drawing& expected, const Drawing& actual,
                                   const ImageTolerance& tolerance, const std::vector<BodyExtent>& approved,
                                   const std::vector<std::string>& names);

/// Writes what shows the difference: <prefix>.difference.png and so on. The two pictures themselves are in
/// `pair` already.
void write_difference(const CaseFolder& folder, const std::string& prefix, const Drawing& expected,
                      const Drawing& actual, PicturePair& pair);

}  // namespace substep::golden
