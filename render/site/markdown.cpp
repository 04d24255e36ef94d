#include "render/site/markdown.h"

#include <fmt/format.h>
#include <md4c-html.h>

#include <stdexcept>

#include "render/markup.h"

namespace substep::render {
namespace {

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

bool is_elsewhere(std::string_view address) {
  return address.starts_with("https://") || address.starts_with("http://") || address.starts_with('#');
}

/// With the attribute's addresses replaced. In text, md4c writes its quotes as entities.
std::string with_addresses(std::string_view html, std::string_view attribute,
                           const std::function<std::string(const std::string&)>& address) {
  const std::string mark = fmt::format(" {}=\"", attribute);
  std::string result;
  for (;;) {
    const std::size_t at = html.find(mark);
    result += html.substr(0, at);
    if (at == std::string_view::npos) return result;
    html.remove_prefix(at + mark.size());
    const std::string_view given = html.substr(0, html.find('"'));
    html.remove_prefix(given.size() + 1);
    const std::string becomes =
        is_elsewhere(given) ? std::string(given) : escaped(address(std::string(given)));
    if (!becomes.empty()) result += fmt::format("{}{}\"", mark, becomes);
  }
}

}  // namespace

std::string html_of_markdown(std::string_view markdown,
                             const std::function<std::string(const std::string&)>& address) {
  const std::string text = without_comments(markdown);
  std::string html;
  const auto append = [](const MD_CHAR* part, MD_SIZE size, void* to) {
    static_cast<std::string*>(to)->append(part, size);
  };
  if (md_html(text.data(), static_cast<MD_SIZE>(text.size()), append, &html, MD_FLAG_TABLES | MD_FLAG_NOHTML,
              0) != 0) {
    throw std::bad_alloc();
  }
  return with_addresses(with_addresses(html, "href", address), "src", address);
}

}  // namespace substep::render
