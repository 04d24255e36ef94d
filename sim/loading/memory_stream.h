#pragma once
/// A stream that assimp reads instead of a file on the disk.

#include <algorithm>
#include <assimp/IOStream.hpp>
#include <cstring>
#include <string_view>

namespace substep {

/// A file that lies in memory; the bytes must outlive it.
class MemoryStream final : public Assimp::IOStream {
 public:
  explicit MemoryStream(std::string_view bytes) : bytes_(bytes) {}

  size_t Read(void* to, size_t size, size_t count) override {
    if (size == 0) return 0;
    count = std::min(count, (bytes_.size() - position_) / size);
    if (count > 0) std::memcpy(to, bytes_.data() + position_, count * size);
    position_ += count * size;
    return count;
  }
  size_t Write(const void*, size_t, size_t) override { return 0; }
  aiReturn Seek(size_t offset, aiOrigin origin) override {
    const size_t start = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? position_ : bytes_.size();
    if (offset > bytes_.size() - start) return aiReturn_FAILURE;
    position_ = start + offset;
    return aiReturn_SUCCESS;
  }
  size_t Tell() const override { return position_; }
  size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::string_view bytes_;
  size_t position_ = 0;
};

}  // namespace substep
