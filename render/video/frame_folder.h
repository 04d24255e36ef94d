#pragma once
/// A film as a folder of numbered pictures.

#include <filesystem>
#include <memory>

#include "sim/log/partial_file.h"

namespace substep::render {

/// Makes `folder` of numbered frames frame_0000.png …: written beside and renamed, so that it is there whole
/// or not at all. An earlier one with nothing but such frames is replaced; anything else in it is an Error.
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
