#include "golden/check/check.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <utility>

#include "golden/check/case_context.h"
#include "golden/suite/sidecar.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/partial_file.h"

namespace substep::golden {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

/// The keys of a worker's messages, one line each.
constexpr const char* made_with_key = "made_with";
constexpr const char* refusal_key = "refusal";
constexpr const char* start_key = "start";
constexpr const char* case_key = "case";

/// Time for the pictures of a case whose command has its own `time_limit`, s.
constexpr double time_for_pictures = 30;

void send(int descriptor, const char* what, const Json& value) {
  const std::string line = Json{{what, value}}.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  std::string_view rest = line;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(1);  // the parent has ended
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
}

extern "C" void end_worker(int /*signal*/) {
  remove_partial_files();
  ::kill(0, SIGKILL);
}

/// Leaves the message about a signal to the parent, whether the signal reaches it alone or a terminal sends
/// it to both.
void end_silently() {
  // Commands of cases are of the worker's group, and end with it.
  ::setpgid(0, 0);
  for (const int signal : {SIGINT, SIGHUP}) {
    struct sigaction now {};
    if (::sigaction(signal, nullptr, &now) == 0 && now.sa_handler != SIG_IGN) {
      std::signal(signal, end_worker);
    }
  }
  std::signal(SIGTERM, end_worker);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
}

/// Checks the cases in the worker's process, and ends it.
[[noreturn]] void work(const CheckPlan& plan, std::span<const SuiteCase> cases, int descriptor) {
  end_silently();
  try {
    const MadeWith made_with = made_with_here(plan);
    send(descriptor, made_with_key, to_json(made_with));
    CheckListener listener;
    listener.before_case = [&](const SuiteCase& entry) { send(descriptor, start_key, entry.name); };
    listener.after_case = [&](const CheckedCase& checked) { send(descriptor, case_key, to_json(checked)); };
    check_cases(cases, plan.options, made_with, listener);
  } catch (const std::exception& error) {
    send(descriptor, refusal_key, error.what());
  }
  // Skip the parent's exit handlers.
  ::_exit(0);
}

/// A process that checks cases, and the messages that it sends.
class Worker {
 public:
  Worker(const CheckPlan& plan, std::span<const SuiteCase> cases) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw Error("no pipe to a process that checks");
    std::fflush(nullptr);
    process_ = ::fork();
    if (process_ == 0) work(plan, cases, ends[1]);
    ::close(ends[1]);
    if (process_ > 0) ::setpgid(process_, process_);
    descriptor_ = ends[0];
    if (process_ < 0) throw Error(fmt::format("no process to check in: {}", std::strerror(errno)));
  }
  ~Worker() {
    end();
    ::close(descriptor_);
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  enum class Event { line, ended, late };

  /// Waits for the next message, until `deadline`.
  Event wait(std::string& line, std::optional<Clock::time_point> deadline) {
    while (true) {
      const std::size_t end_of_line = buffer_.find('\n');
      if (end_of_line != std::string::npos) {
        line = buffer_.substr(0, end_of_line);
        buffer_.erase(0, end_of_line + 1);
        return Event::line;
      }
      int timeout = -1;
      if (deadline) {
        const std::chrono::duration<double, std::milli> left = *deadline - Clock::now();
        if (left.count() <= 0) return Event::late;
        timeout = static_cast<int>(std::min(std::ceil(left.count()), 1e6));
      }
      pollfd waiting{descriptor_, POLLIN, 0};
      if (::poll(&waiting, 1, timeout) <= 0) continue;
      std::array<char, 65536> bytes{};
      const ssize_t got = ::read(descriptor_, bytes.data(), bytes.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return Event::ended;
      buffer_.append(bytes.data(), static_cast<std::size_t>(got));
    }
  }

  /// Ends the process, if it has not ended yet. Returns how it ended, in words.
  std::string end() {
    if (process_ <= 0) return {};
    ::kill(-process_, SIGKILL);
    return wait_for_end();
  }

  std::string wait_for_end() {
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    if (WIFSIGNALED(status)) {
      return fmt::format("it crashed: {} (signal {})", ::strsignal(WTERMSIG(status)), WTERMSIG(status));
    }
    return fmt::format("its process ended with code {}", WEXITSTATUS(status));
  }

 private:
  pid_t process_ = -1;
  int descriptor_ = -1;
  std::string buffer_;
};

class CheckApart {
 public:
  CheckApart(const CheckPlan& plan, const CheckWatcher& watcher, CheckOutput& output)
      : plan_(plan), watcher_(watcher), output_(output) {}

  void run() {
    while (done_ < plan_.cases.size()) {
      const std::size_t before = done_;
      run_worker();
      if (done_ == before) throw Error("a process that checks ended without checking: run it again");
    }
  }

 private:
  const SuiteCase& current() const { return plan_.cases[done_]; }

  /// Receives messages until the worker ends.
  void run_worker() {
    Worker worker(plan_, std::span(plan_.cases).subspan(done_));
    is_in_case_ = false;
    bool has_renderer = false;
    std::string line;
    while (true) {
      std::optional<Clock::time_point> deadline;
      if (is_in_case_) {
        const std::chrono::duration<double> limit(current().time_limit +
                                                  (current().command.empty() ? 0 : time_for_pictures));
        deadline = start_ + std::chrono::duration_cast<Clock::duration>(limit);
      }
      switch (worker.wait(line, deadline)) {
        case Worker::Event::line:
          has_renderer = true;
          receive(Json::parse(line));
          break;
        case Worker::Event::late:
          worker.end();
          add_error(fmt::format("it took longer than its limit, {:g} s", current().time_limit));
          return;
        case Worker::Event::ended: {
          const std::string how = worker.wait_for_end();
          if (is_in_case_) add_error(how);
          if (!has_renderer) throw Error("the renderer cannot be started: " + how);
          return;
        }
      }
    }
  }

  void receive(const Json& message) {
    const auto item = message.begin();
    const std::string& what = item.key();
    const Json& value = item.value();
    if (what == refusal_key) throw Error(value.get<std::string>());
    if (what == made_with_key) output_.set_made_with(value);
    if (what == start_key) {
      is_in_case_ = true;
      start_ = Clock::now();
      if (watcher_.before_case) watcher_.before_case(current().name, done_ + 1, plan_.cases.size());
    }
    if (what == case_key) add(value);
  }

  void add(const Json& entry) {
    is_in_case_ = false;
    ++done_;
    output_.add_case(entry);
    if (watcher_.after_case) watcher_.after_case(entry);
  }

  void add_error(const std::string& why) {
    CheckedCase checked = failed_case(plan_.options, current(), why);
    checked.result.seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    add(to_json(checked));
  }

  const CheckPlan& plan_;
  const CheckWatcher& watcher_;
  CheckOutput& output_;
  std::size_t done_ = 0;
  bool is_in_case_ = false;
  Clock::time_point start_;
};

}  // namespace

void check_with(const CheckOptions& options, const std::function<void(const CheckPlan&, CheckOutput&)>& run) {
  CheckOutput output(options.output);
  try {
    CheckPlan plan{read_suite(options.suite), options, {}};
    plan.options.suite = plan.suite.file;
    plan.cases = select(plan.suite, options.cases);
    output.start(plan.suite, plan.options, plan.cases.size());
    run(plan, output);
    // A check of some cases does not look for orphans.
    output.finish(options.cases.empty() ? orphans(plan.suite) : std::vector<std::filesystem::path>());
  } catch (const Error& error) {
    output.fail(error.what());
    throw;
  }
}

void check_cases(std::span<const SuiteCase> cases, const CheckOptions& options, const MadeWith& made_with,
                 const CheckListener& listener) {
  // Cases of one scene follow each other: it is loaded once.
  std::filesystem::path scene_file;
  std::unique_ptr<Scene> scene;
  for (const SuiteCase& entry : cases) {
    if (listener.before_case) listener.before_case(entry);
    CheckedCase checked;
    try {
      if (!scene || scene_file != entry.scene) {
        scene = nullptr;
        scene = std::make_unique<Scene>(load_scene(entry.scene));
        scene_file = entry.scene;
      }
      checked = check_case(options, made_with, entry, *scene);
    } catch (const std::bad_alloc&) {
      checked = failed_case(options, entry, "there is not enough memory for it");
    } catch (const std::exception& error) {
      checked = failed_case(options, entry, error.what());
    }
    if (listener.after_case) listener.after_case(checked);
  }
}

MadeWith made_with_here(const CheckPlan& plan) {
  const bool has_pictures = std::any_of(plan.cases.begin(), plan.cases.end(),
                                        [](const SuiteCase& entry) { return !entry.images.empty(); });
  return made_with(plan.suite.folder(), has_pictures);
}

Json check(const CheckOptions& options, const CheckWatcher& watcher) {
  check_with(options,
             [&](const CheckPlan& plan, CheckOutput& output) { CheckApart(plan, watcher, output).run(); });
  return read_results(options.output);
}

}  // namespace substep::golden
