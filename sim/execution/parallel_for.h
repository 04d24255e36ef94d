#pragma once
/// A loop on several threads.

#include <cstddef>
#include <functional>
#include <stop_token>

namespace substep {

/// Starts `work(i, stop)` for each i below `count`, in ascending order, on `threads` threads, and returns
/// when all calls have returned. After an exception no call begins, and `stop` is requested, which long work
/// may check. Throws the exception of the lowest i. Calls `wait`, if set, a few times a second on the calling
/// thread.
void parallel_for(int threads, std::size_t count,
                  const std::function<void(std::size_t i, const std::stop_token& stop)>& work,
                  const std::function<void()>& wait = {});

}  // namespace substep
