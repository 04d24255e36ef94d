#pragma once
/// The page of one scene on a site.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

/// Returns a part of a URL, escaped: "a b" as "a%20b".
std::string in_address(std::string_view name);

/// The Markdown beside the scene's file, its first paragraph apart; empty where there is none.
struct SceneText {
  std::string title;
  std::string lead;
  std::string rest;
};
SceneText text_of(const Scene& scene);

/// Returns Markdown as HTML. Links to pages beside it become links to the site's scenes among `names`, from a
/// folder below the site's; other links within the repository are removed.
std::string html_of(const std::string& markdown, const std::vector<std::string>& names);

/// Returns index.html of a scene, beside player.html, poster.png and, with `film`, film.mp4.
std::string scene_page(const SceneText& text, const Comparison& comparison,
                       const std::vector<std::string>& names, bool film);

}  // namespace substep::render
