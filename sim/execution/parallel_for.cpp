#include "sim/execution/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace substep {

void parallel_for(int threads, std::size_t count,
                  const std::function<void(std::size_t, const std::stop_token&)>& work,
                  const std::function<void()>& wait) {
  std::atomic<std::size_t> next{0};
  std::stop_source stop;
  std::size_t failed = count;  // lowest index whose call threw
  std::exception_ptr failure;
  std::mutex mutex;
  std::condition_variable changed;
  int running = std::clamp(threads, 1, static_cast<int>(std::max<std::size_t>(1, count)));
  std::vector<std::jthread> workers;
  for (int i = running; i > 0; --i) {
    workers.emplace_back([&] {
      for (std::size_t index = next++; index < count && !stop.stop_requested(); index = next++) {
        try {
          work(index, stop.get_token());
        } catch (...) {
          const std::lock_guard lock(mutex);
          if (index < failed) {
            failed = index;
            failure = std::current_exception();
          }
          stop.request_stop();
        }
      }
      const std::lock_guard lock(mutex);
      if (--running == 0) changed.notify_all();
    });
  }
  {
    std::unique_lock lock(mutex);
    while (!changed.wait_for(lock, std::chrono::milliseconds(100), [&] { return running == 0; })) {
      if (wait) wait();
    }
  }
  workers.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace substep
