#include "golden/check/check_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "golden/report/junit.h"
#include "golden/report/report.h"
#include "sim/error.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double seconds_between_writes = 1;  // what is on disk is never older than this

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// False where another holds it for longer than the worker of a check that was ended takes to remove what it
/// had not finished: up to 2 s.
bool take_lock(int file) {
  constexpr int tries = 40;
  constexpr std::chrono::milliseconds between{50};
  for (int i = 0; i < tries; ++i) {
    if (::flock(file, LOCK_EX | LOCK_NB) == 0) return true;
    std::this_thread::sleep_for(between);
  }
  return false;
}

}  // namespace

CheckOutput::CheckOutput(fs::path folder) : folder_(std::move(folder)) {
  std::error_code failure;
  fs::create_directories(folder_, failure);
  if (failure && !fs::is_directory(folder_)) {
    throw Error(fmt::format("{}: this folder cannot be made: {}", folder_.string(), failure.message()));
  }
  lock_ = ::open((folder_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0)
    throw Error(fmt::format("{}: cannot be written to: {}", folder_.string(), std::strerror(errno)));
  if (!take_lock(lock_)) {
    ::close(lock_);
    throw Error(fmt::format("{}: another check is writing there: give this one an --output of its own",
                            folder_.string()));
  }
  for (const fs::path& file : {results_file(folder_), junit_file(folder_), report_file(folder_)}) {
    fs::remove(file, failure);
  }
}

CheckOutput::~CheckOutput() {
  ::close(lock_);
}

void CheckOutput::start(const Suite& suite, const CheckOptions& options, std::size_t cases) {
  results_ = empty_results(suite, options, cases);
  write(true);
}

void CheckOutput::set_made_with(const Json& made_with) {
  results_["made_with"] = made_with;
}

void CheckOutput::add_case(Json entry) {
  results_["cases"].push_back(std::move(entry));
  write(false);
}

void CheckOutput::write(bool at_once) {
  if (!at_once && now() - last_written_ < seconds_between_writes) return;
  sum_up(results_);
  if (!results_.at("ended").get<bool>()) results_["exit_code"] = 1;
  write_results(results_, folder_);
  write_junit(results_, folder_);
  last_written_ = now();
}

const Json& CheckOutput::finish(const std::vector<fs::path>& orphans) {
  const fs::path suite_folder = fs::path(results_.at("suite").get<std::string>()).parent_path();
  for (const fs::path& orphan : orphans) {
    results_["orphans"].push_back(below(orphan, suite_folder));
  }
  results_["ended"] = true;
  write(true);
  write_report(results_, folder_);
  return results_;
}

void CheckOutput::fail(const std::string& why) const {
  write_failed_junit(why, folder_);
}

}  // namespace substep::golden
