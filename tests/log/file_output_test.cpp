#include "sim/log/file_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "sim/error.h"
#include "tests/error_message.h"
#include "tests/temporary_folder.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

class FileOutput : public testing::Test {
 protected:
  std::ptrdiff_t file_count() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }

  test::TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
};

TEST_F(FileOutput, WritesAndReplaces) {
  const fs::path file = folder_ / "a.txt";
  write_file(file, "old");
  write_file(file, std::string_view("new\0text", 8));
  EXPECT_EQ(content_of(file), std::string("new\0text", 8));
  EXPECT_EQ(content_of(folder_), std::nullopt);
  EXPECT_EQ(file_count(), 1);
}

TEST_F(FileOutput, KeepsOldFileWhenWritingFails) {
  const fs::path file = folder_ / "a.txt";
  write_file(file, "old");
  // Limit files to 4096 bytes, like a full disk.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{4096, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string message = test::message_of([&] { write_file(file, std::string(100000, 'x')); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(message, testing::HasSubstr("a.txt: cannot be written: "));
  EXPECT_EQ(content_of(file), "old");
  EXPECT_EQ(file_count(), 1);
}

TEST_F(FileOutput, RefusesMissingFolder) {
  EXPECT_THROW(require_folder_of(folder_ / "missing" / "a.txt"), Error);
  EXPECT_THROW(require_folder_of(folder_), Error);
  EXPECT_THROW(write_file(folder_ / "missing" / "a.txt", "x"), Error);
  EXPECT_NO_THROW(require_folder_of(folder_ / "a.txt"));
  EXPECT_NO_THROW(require_folder_of("a.txt"));
}

TEST_F(FileOutput, WritesToTargetOfLink) {
  write_file(folder_ / "real.txt", "old");
  fs::create_symlink("real.txt", folder_ / "link.txt");
  write_file(folder_ / "link.txt", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.txt"));
  EXPECT_EQ(content_of(folder_ / "real.txt"), "new");
}

TEST_F(FileOutput, WritesToDevices) {
  write_file("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace substep
