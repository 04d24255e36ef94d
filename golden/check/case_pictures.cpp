#include "golden/check/case_pictures.h"

#include "golden/compare/flip.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

render::RenderSettings render_settings(const SuiteCase& entry) {
  render::RenderSettings settings;
  settings.width = entry.width;
  settings.height = entry.height;
  return settings;
}

}  // namespace

void CaseFolder::clear() const {
  std::error_code none;
  for (const auto& file : std::filesystem::directory_iterator(folder_, none)) {
    const auto extension = file.path().extension();
    if (extension == ".png" || extension == ".poses" || extension == ".track" || extension == ".html") {
      std::filesystem::remove(file.path());
    }
  }
}

std::filesystem::path CaseFolder::write(const std::string& file_name, std::string_view bytes) const {
  std::filesystem::create_directories(folder_);
  write_file(folder_ / file_name, bytes);
  return folder_ / file_name;
}

CasePainter::CasePainter(const Scene& scene, const SuiteCase& entry, const PoseLog& log)
    : renderer_(scene, render_settings(entry), full_frames(log, scene)) {}

Drawing CasePainter::draw(std::span<const Coordinates> poses) {
  return {renderer_.draw(poses), renderer_.draw_bodies(poses)};
}

std::vector<std::vector<Coordinates>> full_frames(const PoseLog& log, const Scene& scene) {
  std::vector<std::vector<Coordinates>> result;
  for (const PoseLog::Frame& frame : log.frames) {
    if (frame.poses.size() == scene.bodies.size()) result.push_back(frame.poses);
  }
  return result;
}

Viewfinder viewfinder(const Scene& scene, const SuiteCase& entry, const PoseLog& log) {
  Viewfinder finder;
  finder.width = entry.width;
  finder.height = entry.height;
  finder.parts = render::gather_body_mesh(scene).parts;
  const double aspect = static_cast<double>(entry.width) / entry.height;
  std::vector<std::vector<Coordinates>> frames = full_frames(log, scene);
  if (frames.empty()) frames.push_back(initial_state(scene).q);
  finder.view = scene.camera ? render::view_from(*scene.camera, aspect)
                             : render::automatic_view(finder.parts, frames, aspect);
  return finder;
}

PictureComparison compare_pictures(const Drawing& expected, const Drawing& actual,
                                   const ImageTolerance& tolerance, const std::vector<BodyExtent>& approved,
                                   const std::vector<std::string>& names) {
  PictureComparison result{compare(expected.picture, actual.picture, tolerance), {}, {}};
  const Judgement judgement = result.image.judgement;
  if (judgement == Judgement::exact || judgement == Judgement::size) return result;
  const Flip visible = flip(expected.picture, actual.picture);
  result.flip = {visible.mean, visible.percentile_99, visible.max, std::string(visibility(visible))};
  result.blame = blame(expected.picture, actual.picture, expected.bodies, actual.bodies, approved, names);
  return result;
}

void write_difference(const CaseFolder& folder, const std::string& prefix, const Drawing& expected,
                      const Drawing& actual, PicturePair& pair) {
  const auto write = [&](const char* what, const render::Image& image) {
    const std::string file = prefix + "." + what + ".png";
    folder.write(file, render::to_png(image));
    return file;
  };
  pair.difference = write("difference", difference_image(expected.picture, actual.picture));
  pair.flip = write("flip", heat_map(flip(expected.picture, actual.picture)));
  pair.bodies =
      write("bodies", blame_image(expected.picture, actual.picture, expected.bodies, actual.bodies));
}

}  // namespace substep::golden
