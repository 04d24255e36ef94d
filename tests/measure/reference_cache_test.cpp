// Tests the cache of references: a reference is read where nothing has changed, and computed otherwise.

#include "sim/measure/reference_cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "sim/loading/json_value.h"
#include "sim/log/file_output.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"
#include "tests/temporary_folder.h"

namespace substep {
namespace {

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  return files;
}

TEST(ReferenceCache, RoundTripKeepsBits) {
  const test::TemporaryFolder folder;
  const std::vector<double> numbers{0.1, -0.0, 1.0 / 3, 5e-324, 1e300, infinity, 16777217};
  ReferenceCache(folder.path() / "substep").keep("one", numbers);
  const ReferenceCache cache(folder.path() / "substep");
  ASSERT_TRUE(cache.find("one"));
  const auto found = cache.find("one")->get<std::vector<double>>();
  EXPECT_EQ(found, numbers);
  EXPECT_TRUE(std::signbit(found[1]));
  EXPECT_FALSE(cache.find("another"));
  EXPECT_FALSE(ReferenceCache().find("one"));
}

TEST(ReferenceCache, RejectsChangedTruncatedAndForeignFiles) {
  const test::TemporaryFolder folder;
  const ReferenceCache cache(folder.path());
  cache.keep("one", {1, 2, 3});
  cache.keep("other", {4, 5, 6});
  const std::vector<std::filesystem::path> files = files_in(folder.path());
  ASSERT_EQ(files.size(), 2u);
  const std::string whole = *content_of(files[0]);
  const std::string other = *content_of(files[1]);
  // Either key may have the first file.
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    write_file(files[0], changed);
    EXPECT_FALSE(cache.find("one") && cache.find("other")) << "byte " << i;
    write_file(files[0], whole.substr(0, i));
    EXPECT_FALSE(cache.find("one") && cache.find("other")) << i << " bytes";
  }
  write_file(files[0], other);
  EXPECT_FALSE(cache.find("one") && cache.find("other"));
  write_file(files[0], whole);
  EXPECT_TRUE(cache.find("one") && cache.find("other"));
}

TEST(ReferenceCache, RemovesLeastRecentlyUsed) {
  const test::TemporaryFolder folder;
  const std::vector<double> numbers(1000, 0.1);  // nine bytes each
  const ReferenceCache cache(folder.path(), 30'000);
  cache.keep("used", numbers);
  for (const char* const key : {"a", "b", "c", "d"}) {
    // The clock of files may tick in hundredths of a second.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(cache.find("used"));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    cache.keep(key, numbers);
  }
  EXPECT_EQ(files_in(folder.path()).size(), 3u);
  EXPECT_TRUE(cache.find("used"));
  EXPECT_FALSE(cache.find("a"));
  EXPECT_TRUE(cache.find("d"));
}

TEST(ReferenceCache, IgnoresUnwritableFolder) {
  const ReferenceCache cache("/dev/null/substep");
  cache.keep("one", 1);
  EXPECT_FALSE(cache.find("one"));
}

TEST(ReferenceCache, ConcurrentWritersLeaveWholeFiles) {
  const test::TemporaryFolder folder;
  const Json numbers = std::vector<double>(50, 0.1);
  const auto use = [&] {
    const ReferenceCache cache(folder.path(), 1'200);
    for (int i = 0; i < 1000; ++i) {
      const std::string key = std::to_string(i % 3);
      cache.keep(key, numbers);
      const auto found = cache.find(key);
      EXPECT_TRUE(!found || *found == numbers);
    }
  };
  std::thread one(use);
  std::thread other(use);
  one.join();
  other.join();
  EXPECT_FALSE(files_in(folder.path()).empty());
  for (const auto& file : files_in(folder.path())) EXPECT_EQ(file.extension(), ".reference");
}

/// Changes gravity after loading, which the scene's hash does not show.
TEST(CachedReference, DependsOnSceneHash) {
  const test::TemporaryFolder folder;
  const ReferenceCache cache(folder.path());
  for (const char* const name : {"box_stack", "tumbling_body"}) {
    Scene scene = scene_named(name);
    const ReferenceMotion computed = reference_motion(scene, 0.2, 2, cache);
    Scene changed = scene;
    changed.gravity = Vector3(1, 0, 0);
    const ReferenceMotion read = reference_motion(changed, 0.2, 2, cache);
    EXPECT_EQ(read.method, computed.method);
    EXPECT_EQ(read.horizon, computed.horizon);
    EXPECT_EQ(read.divergence_point, computed.divergence_point);
    ASSERT_EQ(read.uncertainties.size(), computed.uncertainties.size());
    ASSERT_EQ(read.motion.samples.size(), computed.motion.samples.size());
    EXPECT_EQ(read.motion.interval, computed.motion.interval);
    for (std::size_t k = 0; k < read.motion.samples.size(); ++k) {
      State kept;  // the cache keeps coordinates and velocities alone
      kept.q = computed.motion.samples[k].q;
      kept.v = computed.motion.samples[k].v;
      EXPECT_EQ(hash(read.motion.samples[k]), hash(kept)) << k;
    }
    ++changed.hash;
    const ReferenceMotion other = reference_motion(changed, 0.2, 2, cache);
    EXPECT_GT((other.motion.samples.back().q[1].linear - computed.motion.samples.back().q[1].linear).norm(),
              1e-3);
  }
}

}  // namespace
}  // namespace substep
