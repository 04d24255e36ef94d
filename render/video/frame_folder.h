#pragma once
/// A film as a folder of numbered pictures.

#include <filesystem>
#include <memory>

#include "sim/log/file_output.h"

namespace substep::render {

/// Makes `folder` of numbered frames frame_0000.png …, whole or not at all: frames are written to a folder
/// beside it, which is renamed. Replaces an earlier folder of such frames, and throws Error where it holds
/// anything else.
class FrameFolder {
 public:
  explicit FrameFolder(const std::filesystem::path& folder);
  std::filesystem::path next();  ///< the file to write the next frame to
  void finish();

 private:
  std::filesystem::path folder_;
  std::unique_ptr<PartialFile> partial_;
  int count_ = 0;
};

}  // namespace substep::render
