#include "render/site/site.h"

#include <fmt/format.h>
#include <md4c-html.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <new>
#include <system_error>

#include "render/image.h"
#include "render/markup.h"
#include "render/player/player_page.h"
#include "render/renderer.h"
#include "render/report/document.h"
#include "render/video/composition.h"
#include "render/video/film_camera.h"
#include "render/video/titles.h"
#include "render/video/video.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::embedded {
std::string_view page_html();
std::string_view site_css();
}  // namespace substep::embedded

namespace substep::render {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view mark = "<meta name=\"generator\" content=\"substep player\">";

std::string without_comments(std::string_view text) {
  std::string result;
  for (;;) {
    const std::size_t open = text.find("<!--");
    result += text.substr(0, open);
    const std::size_t close = open == std::string_view::npos ? open : text.find("-->", open);
    if (close == std::string_view::npos) return result;
    text.remove_prefix(close + 3);
  }
}

/// Replaces the attribute's addresses; an empty replacement removes the attribute. In text, md4c writes
/// quotes as entities.
template <typename Address>
std::string with_addresses(std::string_view html, std::string_view attribute, const Address& address) {
  const std::string begin = fmt::format(" {}=\"", attribute);
  std::string result;
  for (;;) {
    const std::size_t at = html.find(begin);
    result += html.substr(0, at);
    if (at == std::string_view::npos) return result;
    html.remove_prefix(at + begin.size());
    const std::string_view given = html.substr(0, html.find('"'));
    html.remove_prefix(given.size() + 1);
    const bool is_elsewhere =
        given.starts_with("https://") || given.starts_with("http://") || given.starts_with('#');
    const std::string becomes = is_elsewhere ? std::string(given) : escaped(address(std::string(given)));
    if (!becomes.empty()) result += fmt::format("{}{}\"", begin, becomes);
  }
}

/// Encodes a name for a URL: "a b" as "a%20b".
std::string url_encoded(std::string_view name) {
  std::string result;
  for (const char c : name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                          c == '_' || c == '-' || c == '.' || c == '~';
    result += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return result;
}

/// Decodes a name in a URL that stands in HTML: "a%20b&amp;c" as "a b&c".
std::string url_decoded(std::string_view address) {
  std::string name;
  while (!address.empty()) {
    auto byte = static_cast<unsigned char>(address[0]);
    const char* const code = address.data() + 1;
    unsigned char coded = 0;
    std::size_t size = 1;
    if (address.starts_with("&amp;")) {
      size = 5;
    } else if (byte == '%' && address.size() >= 3 &&
               std::from_chars(code, code + 2, coded, 16).ptr == code + 2) {
      byte = coded;
      size = 3;
    }
    name += static_cast<char>(byte);
    address.remove_prefix(size);
  }
  return name;
}

/// The Markdown beside the scene's file, with its first paragraph separate; empty without a file.
struct SceneText {
  std::string title;
  std::string lead;
  std::string rest;
};

SceneText text_of(const Scene& scene) {
  SceneText text;
  text.title = film_title(scene, "");
  fs::path page = scene.file;
  text.rest = content_of(page.replace_extension(".md")).value_or("");
  std::erase(text.rest, '\r');
  const auto cut_line = [&] {
    const std::size_t end = std::min(text.rest.find('\n'), text.rest.size());
    std::string line = text.rest.substr(0, end);
    text.rest.erase(0, std::min(end + 1, text.rest.size()));
    return line;
  };
  if (text.rest.starts_with("# ")) text.title = cut_line().substr(2);
  text.rest.erase(0, std::min(text.rest.find_first_not_of('\n'), text.rest.size()));
  // Take the first paragraph, but no table or heading.
  while (!text.rest.empty() && text.rest[0] != '\n' && text.rest[0] != '|' && text.rest[0] != '#') {
    text.lead += cut_line() + '\n';
  }
  return text;
}

/// Returns Markdown (CommonMark with tables; HTML in it is text) as HTML. Links to pages beside it become
/// links to the site's scenes among `names`, from a folder below the site's; other links within the
/// repository are removed.
std::string html_of(std::string_view markdown, const std::vector<std::string>& names) {
  const std::string text = without_comments(markdown);
  std::string html;
  const auto append = [](const MD_CHAR* part, MD_SIZE size, void* to) {
    static_cast<std::string*>(to)->append(part, size);
  };
  constexpr unsigned flags = MD_FLAG_TABLES | MD_FLAG_NOHTML;
  if (md_html(text.data(), static_cast<MD_SIZE>(text.size()), append, &html, flags, 0) != 0) {
    throw std::bad_alloc();
  }
  const auto address = [&](const std::string& given) -> std::string {
    const fs::path path = url_decoded(given.substr(0, given.find('#')));
    const bool is_beside = path == path.filename() && path.extension() == ".md";
    if (!is_beside || std::ranges::find(names, path.stem().string()) == names.end()) return "";
    return "../" + url_encoded(path.stem().string()) + "/index.html";
  };
  return with_addresses(with_addresses(html, "href", address), "src", address);
}

/// Returns a page of the site. `head`: further elements of its head.
std::string page_of(const std::string& title, std::string_view head, const std::string& body) {
  return filled(embedded::page_html(), {{"title", escaped(title)},
                                        {"head", std::string(head)},
                                        {"style", std::string(embedded::site_css())},
                                        {"body", body}});
}

/// Returns index.html of a scene, beside player.html, poster.png and, with `film`, film.mp4.
std::string scene_page(const SceneText& text, const Comparison& comparison,
                       const std::vector<std::string>& names, bool film) {
  return page_of(text.title, "",
                 fmt::format(R"(<nav><a href="../index.html">All scenes</a></nav>
<h1>{}</h1>
{}
<iframe src="player.html" title="Player" loading="lazy" allow="fullscreen"></iframe>
<p class="quiet"><a href="player.html">The player alone</a></p>
{}{}
<p class="quiet">{}</p>
{}
)",
                             escaped(text.title), html_of(text.lead, names),
                             film ? "<video controls loop muted preload=\"none\" poster=\"poster.png\" "
                                    "src=\"film.mp4\"></video>\n"
                                  : "",
                             report::to_html(table_of(comparison, false)),
                             escaped(words_on_reference(comparison)), html_of(text.rest, names)));
}

/// Throws Error where the folder holds anything but an earlier site.
void require_site_or_nothing(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) return;
  if (!fs::is_directory(folder, ignored))
    throw Error("{}: is not a folder: name another for the site", folder.string());
  if (fs::is_empty(folder, ignored)) return;
  if (content_of(folder / "index.html").value_or("").find(mark) == std::string::npos)
    throw Error("{}: holds what is no site of 'substep player': name another folder", folder.string());
}

std::vector<std::string> names_of(const std::vector<fs::path>& scenes) {
  std::vector<std::string> names;
  for (const fs::path& scene : scenes) {
    const std::string name = scene.stem().string();
    if (name == "index.html")
      throw Error("{}: the site has the name index.html: rename the file", scene.string());
    if (std::ranges::find(names, name) != names.end())
      throw Error("{}: another scene has the name {}: rename one of the files", scene.string(), name);
    names.push_back(name);
  }
  return names;
}

/// Draws the scene at its poster's time, by default half the film, with the poses of the reference or else
/// of the last run that gets there.
Image poster_of(const Scene& scene, const Comparison& comparison) {
  const double time = scene.poster.value_or(comparison.times.back() / 2);
  const auto nearest =
      std::ranges::min_element(comparison.times, {}, [&](double t) { return std::abs(t - time); });
  const auto k = static_cast<std::size_t>(nearest - comparison.times.begin());
  std::vector<Coordinates> poses = initial_state(scene).q;
  for (const Run& run : comparison.runs) {
    if (k < run.poses.size()) poses = run.poses[k];
  }
  if (comparison.reference && k < comparison.reference->known) poses = comparison.reference->poses[k];
  const RenderSettings settings{.width = 640, .height = 360, .steps_back = true};
  return Renderer(scene, settings, seen_frames(scene, comparison)).draw(poses);
}

/// Writes a scene's folder and returns its entry of the index.
std::string make_scene(const SiteSettings& settings, const fs::path& file,
                       const std::vector<std::string>& names, double begun) {
  const std::string name = file.stem().string();
  const double fraction = 1.0 / static_cast<double>(names.size());
  const auto show = [&](double done) { settings.progress(name, begun + fraction * done); };
  show(0);
  const Scene scene = settings.load(file);
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
    video.frame_rate = settings.frame_rate;
    video.title = text.title;
    video.output = whole.path() / "film.mp4";
    video.progress = [&](std::string_view, double done) { show(0.5 + 0.5 * done); };
    make_video(scene, video, comparison);
  }
  // Replace an earlier folder.
  std::error_code failure;
  fs::remove_all(folder, failure);
  if (failure) throw Error("{}: {}", folder.string(), failure.message());
  whole.publish();
  const std::string address = url_encoded(name);
  return fmt::format(
      "<li><a href=\"{0}/index.html\"><img src=\"{0}/poster.png\" width=\"640\" height=\"360\" alt=\"\" "
      "loading=\"lazy\">{1}</a>{2}</li>\n",
      address, escaped(text.title), html_of(text.lead, {}));
}

}  // namespace

int make_site(const SiteSettings& settings) {
  require_site_or_nothing(settings.folder);
  const std::vector<std::string> names = names_of(settings.scenes);
  std::error_code failure;
  fs::create_directories(settings.folder, failure);
  if (failure) throw Error("{}: {}", settings.folder.string(), failure.message());
  // Write an index first, so that a site that was interrupted can be written again.
  const auto write_index = [&](const std::string& entries) {
    const std::string body =
        fmt::format("<h1>{}</h1>\n<ul class=\"scenes\">\n{}</ul>\n", escaped(settings.title), entries);
    write_file(settings.folder / "index.html", page_of(settings.title, mark, body));
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
      settings.failure(settings.scenes[i], error.what());
    }
  }
  write_index(entries);
  return made;
}

}  // namespace substep::render
