#pragma once
/// Markdown as HTML.

#include <functional>
#include <string>
#include <string_view>

namespace substep::render {

/// CommonMark with tables. HTML in it is text, and its comments are left out. `address` says what becomes of
/// links and pictures that do not name another host: empty means that there is nothing to link to.
std::string html_of_markdown(std::string_view markdown,
                             const std::function<std::string(const std::string&)>& address);

}  // namespace substep::render
