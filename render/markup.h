#pragma once
/// Text in HTML and XML.

#include <string>
#include <string_view>

namespace substep {

/// For content and for attributes in double quotes. Control characters, which XML cannot have, become spaces.
std::string escaped(std::string_view text);

}  // namespace substep
