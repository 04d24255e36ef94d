#pragma once
/// What a site has of one scene.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

/// A part of an address, as it has to be written in one: "a b" as "a%20b".
std::string in_address(std::string_view name);

/// The Markdown beside the scene's file, its first paragraph apart; empty where there is none.
struct SceneText {
  std::string title;
  std::string lead;
  std::string rest;
};
SceneText text_of(const Scene& scene);

/// As HTML. Links to pages beside it become links to the site's scenes among `names`, from a folder below the
/// site's; others within the repository lead nowhere.
std::string html_of(const std::string& markdown, const std::vector<std::string>& names);

/// A page of index.html, player.html, poster.png and, with `film`, film.mp4 in one folder.
std::string scene_page(const SceneText& text, const Comparison& comparison,
                       const std::vector<std::string>& names, bool film);

}  // namespace substep::render
