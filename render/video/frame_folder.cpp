#include "render/video/frame_folder.h"

#include <fmt/format.h>

#include <string>
#include <system_error>

#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

bool is_frame_name(const std::string& name) {
  return name.starts_with("frame_") && name.ends_with(".png") &&
         name.find_first_not_of("0123456789", 6) == name.size() - 4;
}

void refuse_other_files(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (is_frame_name(name)) continue;
    throw Error(fmt::format("{}: holds {}, which is no frame: name another folder for the frames",
                            folder.string(), name));
  }
}

}  // namespace

FrameFolder::FrameFolder(const fs::path& folder)
    : folder_(folder.has_filename() ? folder : folder.parent_path()) {
  std::error_code ignored;
  if (fs::exists(folder_, ignored)) {
    if (!fs::is_directory(folder_, ignored)) {
      throw Error(fmt::format("{}: is not a folder: name another for the frames", folder_.string()));
    }
    refuse_other_files(folder_);
  } else {
    require_folder_of(folder_);
  }
  partial_ = std::make_unique<PartialFile>(folder_, PartialFile::Kind::folder);
}

fs::path FrameFolder::next() {
  return partial_->path() / fmt::format("frame_{:04d}.png", count_++);
}

void FrameFolder::finish() {
  std::error_code failure;
  if (fs::exists(folder_, failure)) {
    // Once more: much time may have passed.
    refuse_other_files(folder_);
    fs::remove_all(folder_, failure);
  }
  partial_->publish();
}

}  // namespace substep::render
