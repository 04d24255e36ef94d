#include "sim/execution/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace substep {
namespace {

TEST(ParallelFor, CallsEachIndexOnce) {
  for (const int threads : {1, 3, 100}) {
    std::vector<std::atomic<int>> calls(50);
    parallel_for(threads, calls.size(), [&](std::size_t i, const std::stop_token& stop) {
      EXPECT_FALSE(stop.stop_requested());
      ++calls[i];
    });
    for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1) << threads;
  }
  parallel_for(4, 0, [](std::size_t, const std::stop_token&) { ADD_FAILURE(); });
}

TEST(ParallelFor, OneThreadKeepsOrder) {
  std::vector<std::size_t> order;
  parallel_for(1, 20, [&](std::size_t i, const std::stop_token&) { order.push_back(i); });
  std::vector<std::size_t> expected(20);
  std::iota(expected.begin(), expected.end(), 0U);
  EXPECT_EQ(order, expected);
}

TEST(ParallelFor, StopsAtFirstError) {
  std::atomic<int> begun{0};
  try {
    parallel_for(2, 1000, [&](std::size_t i, const std::stop_token& stop) {
      ++begun;
      // Wait until both calls run. Call 1 fails first; call 0 receives a stop request, then fails too.
      while (begun < 2 || (i == 0 && !stop.stop_requested())) std::this_thread::yield();
      throw std::runtime_error(std::to_string(i));
    });
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "0");
  }
  EXPECT_EQ(begun, 2);
}

TEST(ParallelFor, CallsWaitOnCallingThread) {
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<bool> waited{false};
  parallel_for(
      2, 2,
      [&](std::size_t, const std::stop_token&) {
        while (!waited) std::this_thread::yield();
      },
      [&] {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        waited = true;
      });
  EXPECT_TRUE(waited);
}

}  // namespace
}  // namespace substep
