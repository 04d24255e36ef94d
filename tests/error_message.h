#pragma once
/// The message of an Error, for tests of refusals.

#include <string>

#include "sim/error.h"

namespace substep::test {

/// Returns the message of the Error that the call throws; empty where it throws none.
template <typename Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace substep::test
