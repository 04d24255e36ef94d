#include "render/video/frame_queue.h"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace substep::render {
namespace {

class FrameQueue {
 public:
  FrameQueue(int count, int ahead) : count_(count), ahead_(ahead) {}

  void work(const std::function<Painter()>& make_painter) {
    try {
      const Painter paint = make_painter();
      for (int k = claim(); k < count_; k = claim()) deliver(k, paint(k));
    } catch (...) {
      fail(std::current_exception());
    }
  }

  /// Waits for frame k. Throws what a painter threw.
  Image take(int k) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || ready_.contains(k); });
    if (failure_) std::rethrow_exception(failure_);
    Image frame = std::move(ready_.extract(k).mapped());
    taken_ = k + 1;
    changed_.notify_all();
    return frame;
  }

  void fail(const std::exception_ptr& failure) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = failure;
    changed_.notify_all();
  }

 private:
  /// The next frame to paint, as soon as it is not too far ahead of the one taken last; `count_`: none.
  int claim() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || next_ >= count_ || next_ < taken_ + ahead_; });
    return failure_ ? count_ : std::min(next_++, count_);
  }

  void deliver(int k, Image frame) {
    const std::lock_guard lock(mutex_);
    ready_.emplace(k, std::move(frame));
    changed_.notify_all();
  }

  const int count_;
  const int ahead_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<int, Image> ready_;
  int next_ = 0;
  int taken_ = 0;
  std::exception_ptr failure_;
};

}  // namespace

void paint_in_order(int count, int threads, const std::function<Painter()>& make_painter,
                    const std::function<void(int, const Image&)>& take) {
  threads = std::clamp(threads, 1, std::max(1, count));
  FrameQueue queue(count, 4 * threads);
  std::vector<std::thread> workers;
  workers.reserve(static_cast<std::size_t>(threads));
  for (int i = 0; i < threads; ++i) workers.emplace_back([&] { queue.work(make_painter); });
  std::exception_ptr failure;
  try {
    for (int k = 0; k < count; ++k) take(k, queue.take(k));
  } catch (...) {
    failure = std::current_exception();
    queue.fail(failure);
  }
  for (std::thread& worker : workers) worker.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace substep::render
