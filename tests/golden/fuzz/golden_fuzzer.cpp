/// A fuzz target for the files of the regression suite and of sweeps. The first line of the bytes is the kind
/// of the file, the rest its content. With clang: cmake --preset fuzz, then
/// build-fuzz/tests/golden/fuzz/golden_fuzzer with a folder for what it finds and tests/golden/fuzz/corpus.

#include "tests/golden/fuzz/golden_fuzzer.h"

#include <cstdint>
#include <filesystem>
#include <string>

#include "golden/compare/track.h"
#include "golden/suite/sidecar.h"
#include "golden/suite/suite.h"
#include "sim/log/pose_log.h"
#include "sim/study/sweep.h"
#include "tests/fuzz_corpus.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using test::require;

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
  // Suites and sweeps of the corpus name this scene.
  fs::copy_file(fs::path(test::source_folder) / "scenes/pendulum.gltf", test::fuzz_folder() / "pendulum.gltf",
                fs::copy_options::skip_existing);
  const std::optional<std::string> message =
      test::refusal("fuzzed", bytes, [&](const fs::path& file) { read(kind, bytes, file); });
  // A record has no file of its own, so its errors name none.
  require(!message || kind == "record" || message->find("fuzzed") != std::string::npos ||
              message->find(test::fuzz_folder().string()) != std::string::npos,
          "a refusal does not name the file");
  return !message;
}

}  // namespace substep::golden

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  substep::golden::reads_or_refuses({reinterpret_cast<const char*>(data), size});
  return 0;
}
