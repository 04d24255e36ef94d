#include "render/report/gnuplot.h"

#include <fmt/format.h>

#include <system_error>

#include "sim/error.h"
#include "sim/execution/child_process.h"

namespace substep::report {
namespace {

bool run_gnuplot(const ChildProcess::Streams& streams) {
  try {
    return ChildProcess({"gnuplot"}, streams).succeeds();
  } catch (const std::system_error& error) {
    throw Error(
        fmt::format("the program gnuplot, which draws figures, cannot be started ({}): on Debian, "
                    "apt-get install gnuplot-nox",
                    error.code().message()));
  }
}

}  // namespace

std::string gnuplot(const std::string& script) {
  const TemporaryFile in(script);
  const TemporaryFile out;
  const TemporaryFile messages;
  const bool succeeds = run_gnuplot({in.descriptor(), out.descriptor(), messages.descriptor()});
  std::string text = out.content();
  if (!succeeds || text.empty()) throw Error(fmt::format("gnuplot failed: {}", messages.content()));
  return text;
}

}  // namespace substep::report
