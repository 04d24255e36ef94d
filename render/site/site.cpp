#include "render/site/site.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "render/embedded_file.h"
#include "render/image.h"
#include "render/markup.h"
#include "render/player/player_page.h"
#include "render/renderer.h"
#include "render/site/scene_page.h"
#include "render/video/seen_frames.h"
#include "render/video/video.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/log/partial_file.h"

SUBSTEP_EMBEDDED_FILE(index_html, SUBSTEP_SITE "/index.html")
SUBSTEP_EMBEDDED_FILE(index_css, SUBSTEP_SITE "/site.css")

namespace substep::render {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view mark = "<meta name=\"generator\" content=\"substep player\">";

/// Only an earlier site may be written over.
void require_site_or_nothing(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) return;
  if (!fs::is_directory(folder, ignored)) {
    throw Error(fmt::format("{}: is not a folder: name another for the site", folder.string()));
  }
  if (fs::is_empty(folder, ignored)) return;
  if (content_of(folder / "index.html").value_or("").find(mark) == std::string::npos) {
    throw Error(
        fmt::format("{}: holds what is no site of 'substep player': name another folder", folder.string()));
  }
}

std::vector<std::string> names_of(const std::vector<fs::path>& scenes) {
  std::vector<std::string> names;
  for (const fs::path& scene : scenes) {
    const std::string name = scene.stem().string();
    if (std::ranges::find(names, name) != names.end() || name == "index.html") {
      throw Error(fmt::format("{}: another scene has the name {}: give one of them", scene.string(), name));
    }
    names.push_back(name);
  }
  return names;
}

/// The moment that shows the scene's point, as the reference has it or else the last run that gets there.
Image poster_of(const Scene& scene, const Comparison& comparison) {
  const double time = scene.poster.value_or(0.6 * comparison.times.back());
  const auto nearest =
      std::ranges::min_element(comparison.times, {}, [&](double t) { return std::abs(t - time); });
  const auto k = static_cast<std::size_t>(nearest - comparison.times.begin());
  std::vector<Coordinates> poses = initial_state(scene).q;
  for (const Run& run : comparison.runs) {
    if (k < run.poses.size()) poses = run.poses[k];
  }
  if (comparison.reference && k < comparison.reference->known) poses = comparison.reference->poses[k];
  RenderSettings settings;
  settings.width = 640;
  settings.height = 360;
  settings.steps_back = true;
  return Renderer(scene, settings, seen_frames(scene, comparison)).draw(poses);
}

/// Puts a folder that is whole in the place of an earlier one.
void publish(PartialFile& whole, const fs::path& folder) {
  std::error_code failure;
  fs::remove_all(folder, failure);
  if (failure) throw Error(fmt::format("{}: {}", folder.string(), failure.message()));
  whole.publish();
}

/// An entry of the index.
std::string make_scene(const SiteSettings& settings, const fs::path& file,
                       const std::vector<std::string>& names, double begun) {
  const std::string name = file.stem().string();
  const double share = 1.0 / static_cast<double>(names.size());
  const auto show = [&](double done) {
    if (settings.progress) settings.progress(name, begun + share * done);
  };
  show(0);
  const Scene scene = load_scene(file);
  const ComparisonSettings compared = settings.comparison(scene);
  const Comparison comparison =
      simulate_comparison(scene, compared, [&](double done) { show((settings.films ? 0.5 : 0.9) * done); });
  const SceneText text = text_of(scene);
  const fs::path folder = settings.folder / name;
  PartialFile whole(folder, PartialFile::Kind::folder);
  write_file(whole.path() / "player.html", player_page(scene, comparison, text.title, settings.speed));
  write_png(poster_of(scene, comparison), whole.path() / "poster.png");
  write_file(whole.path() / "index.html", scene_page(text, comparison, names, settings.films));
  if (settings.films) {
    VideoSettings video;
    video.comparison = compared;
    video.threads = compared.threads;
    video.frame_rate = settings.frame_rate;
    video.title = text.title;
    video.output = whole.path() / "film.mp4";
    video.progress = [&](std::string_view, double done) { show(0.5 + 0.5 * done); };
    make_video(scene, video, comparison);
  }
  publish(whole, folder);
  const std::string place = in_address(name);
  return fmt::format(
      "<li><a href=\"{0}/index.html\"><img src=\"{0}/poster.png\" width=\"640\" height=\"360\" alt=\"\" "
      "loading=\"lazy\">{1}</a>{2}</li>\n",
      place, escaped(text.title), html_of(text.lead, {}));
}

}  // namespace

int make_site(const SiteSettings& settings) {
  require_site_or_nothing(settings.folder);
  const std::vector<std::string> names = names_of(settings.scenes);
  std::error_code failure;
  fs::create_directories(settings.folder, failure);
  if (failure) throw Error(fmt::format("{}: {}", settings.folder.string(), failure.message()));
  // So that a site that was interrupted can be written again.
  const auto write_index = [&](const std::string& entries) {
    write_file(settings.folder / "index.html", filled(index_html(), {{"title", escaped(settings.title)},
                                                                     {"mark", std::string(mark)},
                                                                     {"style", std::string(index_css())},
                                                                     {"entries", entries}}));
  };
  write_index("");
  std::string entries;
  int made = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    try {
      entries += make_scene(settings, settings.scenes[i], names,
                            static_cast<double>(i) / static_cast<double>(names.size()));
      ++made;
    } catch (const Error& error) {
      if (settings.failure) settings.failure(settings.scenes[i], error.what());
    }
  }
  write_index(entries);
  return made;
}

}  // namespace substep::render
