#include "render/markup.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "sim/loading/json_value.h"

namespace substep::render {

std::string escaped(std::string_view text) {
  static constexpr std::array<std::pair<char, std::string_view>, 4> entities{
      {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}}};
  const std::string bytes = Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string result;
  for (const char c : Json::parse(bytes).get<std::string>()) {
    const auto entity = std::ranges::find(entities, c, &std::pair<char, std::string_view>::first);
    const bool is_control = static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t';
    if (entity != entities.end()) {
      result += entity->second;
    } else {
      result += is_control ? ' ' : c;
    }
  }
  return result;
}

std::string filled(std::string_view page, const std::vector<std::pair<std::string, std::string>>& contents) {
  std::string result;
  while (!page.empty()) {
    const std::size_t open = page.find("{{");
    const std::size_t close = page.find("}}", open);
    result += page.substr(0, open);
    if (open == std::string_view::npos) break;
    const std::string_view name = page.substr(open + 2, close - open - 2);
    const auto found = std::ranges::find(contents, name, &std::pair<std::string, std::string>::first);
    if (found == contents.end()) throw std::logic_error("a page has no content for " + std::string(name));
    result += found->second;
    page.remove_prefix(close + 2);
  }
  return result;
}

}  // namespace substep::render
