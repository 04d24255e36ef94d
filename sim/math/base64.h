#pragma once
/// Bytes as text: the base64 of RFC 4648, as data URIs have it.

#include <optional>
#include <string>
#include <string_view>

namespace substep {

std::string base64(std::string_view bytes);

/// The bytes of a text, with or without '=' at its end. The first byte that base64 does not have ends it, and
/// is then `stranger`.
std::string base64_decoded(std::string_view text, std::optional<char>& stranger);

}  // namespace substep
