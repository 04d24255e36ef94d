#pragma once
/// Text in HTML and XML.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace substep::render {

/// Escapes text for content and for attributes in double quotes. Control characters, which XML cannot have,
/// become spaces, and bytes that are not UTF-8 become U+FFFD.
std::string escaped(std::string_view text);

/// Returns `page` with each content in place of its name between {{ and }}. Throws std::logic_error where
/// `contents` lacks a name.
std::string filled(std::string_view page, const std::vector<std::pair<std::string, std::string>>& contents);

}  // namespace substep::render
