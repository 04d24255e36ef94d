#pragma once
/// Converts bytes to text in base64 (RFC 4648), as data URIs have it.

#include <optional>
#include <string>
#include <string_view>

namespace substep {

std::string base64(std::string_view bytes);  ///< returns text that is padded with '='

/// Returns the bytes of a text, with or without '=' at its end. Stops at the first byte that is not base64,
/// and puts it into `invalid`.
std::string base64_decoded(std::string_view text, std::optional<char>& invalid);

}  // namespace substep
