#pragma once
/// The exception for bad input: a sentence for the person who gave the input.

#include <fmt/core.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace substep {

/// An error in a file, an option or a scene. The message names the file, the position in it, what is wrong
/// and, where there is a remedy, what to do. The program prints it and exits with code 2.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// Formats the message as fmt::format() does. A text alone is taken as it is, with its braces.
  template <typename First, typename... Others>
  Error(fmt::format_string<First, Others...> text, First&& first, Others&&... others)
      : std::runtime_error(fmt::format(text, std::forward<First>(first), std::forward<Others>(others)...)) {}
};

}  // namespace substep
