#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <thread>

#include "golden/check/case_context.h"
#include "golden/report/report.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

using Clock = std::chrono::steady_clock;

/// The keys of a worker's messages, one line each.
constexpr const char* made_with_key = "made_with";
constexpr const char* refusal_key = "refusal";
constexpr const char* case_key = "case";

/// Time for the pictures of a case that runs a command, beside its `time_limit`, s.
constexpr double time_for_pictures = 30;

void send(int descriptor, const char* key, const Json& value) {
  const std::string line = Json{{key, value}}.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
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

/// Ends the worker on a signal without a message, since the parent prints one.
void end_silently() {
  // End the commands of cases, too: they are in the worker's process group.
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

/// Checks the cases whose indices the parent sends, in the worker's process, and ends it.
[[noreturn]] void work(const CheckPlan& plan, int descriptor) {
  end_silently();
  try {
    CaseChecker checker(plan);
    send(descriptor, made_with_key, to_json(checker.made_with()));
    std::size_t index = 0;
    while (::read(descriptor, &index, sizeof index) == sizeof index) {
      send(descriptor, case_key, to_json(checker.check(plan.cases[index])));
    }
  } catch (const std::exception& error) {
    send(descriptor, refusal_key, error.what());
  }
  // Skip the parent's exit handlers.
  ::_exit(0);
}

/// A process that checks one case after another.
struct Worker {
  explicit Worker(const CheckPlan& plan) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw Error("no socket to a process that checks");
    std::fflush(nullptr);
    process = ::fork();
    if (process == 0) work(plan, ends[1]);
    ::close(ends[1]);
    if (process > 0) ::setpgid(process, process);
    descriptor = ends[0];
    if (process < 0) throw Error("no process to check in: {}", std::strerror(errno));
  }
  ~Worker() {
    end();
    ::close(descriptor);
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Makes the process check a case.
  void give(std::size_t case_index) {
    index = case_index;
    start = Clock::now();
    // Ignore a failure: reading from the worker finds that it has ended.
    ::send(descriptor, &case_index, sizeof case_index, MSG_NOSIGNAL);
  }

  /// Reads the process's output and calls `receive` with each whole message. Returns false when the process
  /// has ended.
  bool read(const std::function<void(const Json& message)>& receive) {
    std::array<char, 65536> bytes{};
    const ssize_t got = ::read(descriptor, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) return true;
    if (got <= 0) return false;
    buffer.append(bytes.data(), static_cast<std::size_t>(got));
    for (std::size_t end = 0; (end = buffer.find('\n')) != std::string::npos;) {
      const Json message = Json::parse(buffer.substr(0, end));
      buffer.erase(0, end + 1);
      receive(message);
    }
    return true;
  }

  /// Ends the process, if it has not ended yet.
  void end() {
    if (process <= 0) return;
    ::kill(-process, SIGKILL);
    wait_for_end();
  }

  /// Waits for the process's end, and returns in words how it ended.
  std::string wait_for_end() {
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    process = -1;
    if (WIFSIGNALED(status)) {
      return fmt::format("it crashed: {} (signal {})", ::strsignal(WTERMSIG(status)), WTERMSIG(status));
    }
    return fmt::format("its process ended with code {}", WEXITSTATUS(status));
  }

  pid_t process = -1;
  int descriptor = -1;
  std::optional<std::size_t> index;  ///< of the case that it checks
  Clock::time_point start;           ///< of that case
  std::string buffer;                ///< received part of its next message
};

/// Checks the plan's cases in worker processes, at most one for each processor.
class ParallelCheck {
 public:
  ParallelCheck(const CheckPlan& plan, const CheckWatcher& watcher, CheckOutput& output)
      : plan_(plan), watcher_(watcher), output_(output), entries_(plan.cases.size()) {}

  void run() {
    const std::size_t most = std::max(1U, std::thread::hardware_concurrency());
    workers_.resize(std::min(most, plan_.cases.size()));
    for (auto& worker : workers_) worker = std::make_unique<Worker>(plan_);
    while (delivered_ < entries_.size()) {
      wait();
      for (auto& worker : workers_) {
        if (worker->index && Clock::now() >= deadline(*worker)) end_late(worker);
      }
    }
  }

 private:
  using Slot = std::unique_ptr<Worker>;

  Clock::time_point deadline(const Worker& worker) const {
    const SuiteCase& entry = plan_.cases[*worker.index];
    const std::chrono::duration<double> limit(entry.time_limit +
                                              (entry.command.empty() ? 0 : time_for_pictures));
    return worker.start + std::chrono::duration_cast<Clock::duration>(limit);
  }

  /// Waits until a worker sends a message or exceeds its time limit, and receives the messages.
  void wait() {
    std::vector<pollfd> waiting;
    double timeout = -1;
    for (const Slot& worker : workers_) {
      waiting.push_back({worker->descriptor, POLLIN, 0});
      if (!worker->index) continue;
      const std::chrono::duration<double, std::milli> left = deadline(*worker) - Clock::now();
      const double wait = std::clamp(std::ceil(left.count()), 0.0, 1e6);
      timeout = timeout < 0 ? wait : std::min(timeout, wait);
    }
    if (::poll(waiting.data(), waiting.size(), static_cast<int>(timeout)) <= 0) return;
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      Worker& worker = *workers_[i];
      if (waiting[i].revents == 0) continue;
      if (!worker.read([&](const Json& message) { receive(message, worker); })) replace(workers_[i]);
    }
  }

  void receive(const Json& message, Worker& worker) {
    const auto item = message.begin();
    const std::string& key = item.key();
    if (key == refusal_key) throw Error(item.value().get<std::string>());
    if (key == made_with_key) output_.set_made_with(item.value());
    if (key == case_key) {
      add(*worker.index, item.value());
      worker.index.reset();
    }
    if (given_ == entries_.size()) return;
    if (watcher_.before_case) watcher_.before_case(plan_.cases[given_].name, given_ + 1, entries_.size());
    worker.give(given_++);
  }

  /// Replaces a process that has ended.
  void replace(Slot& worker) {
    const std::string how = worker->wait_for_end();
    if (!worker->index) throw Error("a worker ended between cases: {}: run the check again", how);
    add_error(*worker, how);
    worker = std::make_unique<Worker>(plan_);
  }

  void end_late(Slot& worker) {
    worker->end();
    add_error(*worker,
              fmt::format("it took longer than its limit, {:g} s", plan_.cases[*worker->index].time_limit));
    worker = std::make_unique<Worker>(plan_);
  }

  void add_error(const Worker& worker, const std::string& why) {
    CaseResult result = failed_case(plan_.options.output, plan_.cases[*worker.index], why);
    result.seconds = std::chrono::duration<double>(Clock::now() - worker.start).count();
    add(*worker.index, to_json(result));
  }

  /// Adds a result, and delivers all results up to the first missing one, in the suite's order.
  void add(std::size_t index, const Json& entry) {
    entries_[index] = entry;
    for (; delivered_ < entries_.size() && !entries_[delivered_].is_null(); ++delivered_) {
      output_.add_case(entries_[delivered_]);
      if (watcher_.after_case) watcher_.after_case(entries_[delivered_]);
    }
  }

  const CheckPlan& plan_;
  const CheckWatcher& watcher_;
  CheckOutput& output_;
  std::vector<Slot> workers_;
  std::vector<Json> entries_;  ///< of the cases, in the suite's order; null: not checked yet
  std::size_t given_ = 0;      ///< cases that were given to workers
  std::size_t delivered_ = 0;  ///< entries that the output has
};

}  // namespace

void check_with(const CheckOptions& options, const std::function<void(const CheckPlan&, CheckOutput&)>& run) {
  CheckOutput output(options.output);
  try {
    CheckPlan plan{read_suite(options.suite), options, {}};
    plan.cases = select(plan.suite, options.cases);
    output.start(plan);
    run(plan, output);
    // A check of some cases does not look for orphans.
    output.finish(options.cases.empty() ? orphans(plan.suite) : std::vector<std::filesystem::path>());
  } catch (const std::exception& error) {
    write_failed_junit(error.what(), options.output);
    throw;
  }
}

Json check(const CheckOptions& options, const CheckWatcher& watcher) {
  check_with(options,
             [&](const CheckPlan& plan, CheckOutput& output) { ParallelCheck(plan, watcher, output).run(); });
  return read_results(options.output);
}

}  // namespace substep::golden
