#pragma once
/// A request of HTTP/1.1, as much of it as a page on the loopback address sends.

#include <map>
#include <string>
#include <string_view>

namespace substep {

struct HttpRequest {
  std::string method;
  std::string target;                          ///< "/token/approve"
  std::map<std::string, std::string> headers;  ///< names in small letters
  std::string body;

  std::string header(const std::string& name) const;
};

/// How many bytes the whole request has, by its head: 0 while the head is not there yet. Throws Error when it
/// is none, or longer than a review sends.
std::size_t request_length(std::string_view bytes);

/// Of all of a request's bytes. Throws Error.
HttpRequest request_in(std::string_view bytes);

/// A whole answer; the connection ends with it. Each of `more_headers` has its line's end.
std::string http_answer(int status, std::string_view type, std::string_view body,
                        std::string_view more_headers = {});

}  // namespace substep
