#include "tests/golden/fuzz/golden_fuzzer.h"
#include "tests/folders.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "golden/compare/track.h"
#include "golden/suite/sidecar.h"
#include "golden/suite/suite.h"
#include "sim/error.h"
#include "sim/log/pose_log.h"
#include "sim/study/sweep.h"
#include "tests/temporary_folder.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

/// Returns a folder with the scene that suites and sweeps of the corpus name. The folder is removed when the
/// program ends.
const fs::path& folder() {
  static const test::TemporaryFolder made;
  static const bool copied =
      fs::copy_file(fs::path(test::source_folder) / "scenes/pendulum.gltf", made.path() / "pendulum.gltf");
  static_cast<void>(copied);
  return made.path();
}

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "the parsed content is not valid: %s\n", what);
  std::abort();
}

void read(std::string_view kind, std::string_view content, const fs::path& file) {
  if (kind == "pose-log") {
    const PoseLog log = parse_pose_log(content, file.string());
    require(!log.frames.empty() && log.full_every >= 1 && !log.bodies.empty(), "a pose log");
    // Writing a parsed log and parsing it again changes nothing.
    const std::string text = to_text(log);
    require(to_text(parse_pose_log(text, file.string())) == text, "a pose log written back");
    require(compare(log, log).none(), "a pose log compared with itself");
  } else if (kind == "track") {
    for (const Track::Frame& frame : read_track(file).frames) {
      for (const Coordinates& pose : frame.poses) require(pose.linear.allFinite(), "a track's pose");
    }
  } else if (kind == "sidecar") {
    read_sidecar(file);
  } else if (kind == "suite") {
    for (const SuiteCase& entry : read_suite(file).cases) {
      require(entry.frames >= 0 && entry.full_every >= 1 && entry.width > 0 && entry.height > 0,
              "a suite's case");
    }
  } else if (kind == "sweep") {
    for (const SweepJob& job : read_sweep(file).jobs)
      require(!job.key.empty() && job.settings.step > 0, "a job");
  } else if (kind == "record") {
    const SweepRecord record = record_in(std::string(content));
    require(record.size > 0 && record.duration > 0, "a record");
    require(!record.metrics || record.metrics->error.position.rms >= 0, "a record's error");
  }
}

}  // namespace

bool reads_or_refuses(std::string_view bytes) {
  const std::size_t end = bytes.substr(0, 16).find('\n');
  if (end == std::string_view::npos) return false;
  const std::string_view kind = bytes.substr(0, end);
  bytes.remove_prefix(end + 1);
  const fs::path file = folder() / "fuzzed";
  std::ofstream(file, std::ios::binary) << bytes;
  bool was_read = false;
  try {
    read(kind, bytes, file);
    was_read = true;
  } catch (const Error& error) {
    const std::string_view message = error.what();
    // A record has no file of its own, so its errors name none.
    require(kind == "record" || message.find("fuzzed") != std::string_view::npos ||
                message.find(folder().string()) != std::string_view::npos,
            "a refusal does not name the file");
  }
  std::error_code ignored;
  fs::remove(file, ignored);
  return was_read;
}

}  // namespace substep::golden
