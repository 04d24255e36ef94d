#pragma once
/// Text in HTML and XML.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace substep::render {

/// For content and for attributes in double quotes. Control characters, which XML cannot have, become spaces.
std::string escaped(std::string_view text);

/// `page` with each content where it has the content's name between {{ and }}. Throws std::logic_error where
/// it names another.
std::string filled(std::string_view page, const std::vector<std::pair<std::string, std::string>>& contents);

}  // namespace substep::render
