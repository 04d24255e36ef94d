#include "golden/review/http_request.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>

#include "sim/error.h"

namespace substep {
namespace {

constexpr std::size_t longest_head = 16384;
constexpr std::size_t longest_body = 65536;

std::string in_small_letters(std::string_view text) {
  std::string result;
  for (const unsigned char c : text) result += static_cast<char>(std::tolower(c));
  return result;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

std::string_view next_line(std::string_view& rest) {
  const std::size_t end = rest.find("\r\n");
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 2);
  return line;
}

HttpRequest head_of(std::string_view head) {
  HttpRequest request;
  const std::string_view first = next_line(head);
  const std::size_t one = first.find(' ');
  const std::size_t two = first.rfind(' ');
  if (one == std::string_view::npos || two == one || !first.substr(two + 1).starts_with("HTTP/1.")) {
    throw Error("not a request");
  }
  request.method = first.substr(0, one);
  request.target = first.substr(one + 1, two - one - 1);
  while (!head.empty()) {
    const std::string_view line = next_line(head);
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) throw Error("a header without a colon");
    request.headers[in_small_letters(line.substr(0, colon))] = trimmed(line.substr(colon + 1));
  }
  return request;
}

}  // namespace

std::string HttpRequest::header(const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? std::string() : found->second;
}

std::size_t request_length(std::string_view bytes) {
  const std::size_t end = bytes.find("\r\n\r\n");
  if (end == std::string_view::npos) {
    if (bytes.size() > longest_head) throw Error("a head that is too long");
    return 0;
  }
  const std::string length = head_of(bytes.substr(0, end)).header("content-length");
  std::size_t body = 0;
  if (!length.empty()) {
    const auto read = std::from_chars(length.data(), length.data() + length.size(), body);
    if (read.ec != std::errc{} || read.ptr != length.data() + length.size() || body > longest_body) {
      throw Error("a body of no length, or too long");
    }
  }
  return end + 4 + body;
}

HttpRequest request_in(std::string_view bytes) {
  const std::size_t end = bytes.find("\r\n\r\n");
  if (end == std::string_view::npos) throw Error("not a request");
  HttpRequest request = head_of(bytes.substr(0, end));
  request.body = bytes.substr(end + 4);
  return request;
}

std::string http_answer(int status, std::string_view type, std::string_view body,
                        std::string_view more_headers) {
  return fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n"
      "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nConnection: close\r\n{}\r\n{}",
      status, status == 200 ? "OK" : "Refused", type, body.size(), more_headers, body);
}

}  // namespace substep
