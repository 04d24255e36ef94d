#pragma once
/// A cache of reference motions, whose computation takes most of a film's time.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "sim/loading/json_value.h"
#include "sim/measure/motion.h"
#include "sim/model/state.h"

namespace substep {

/// Returns the hash of this program's file, which marks its results; nothing where the file cannot be read.
std::optional<std::uint64_t> program_hash();

/// A folder of results by key, such as a scene's hash with the settings. A result is used only by the program
/// that stored it, with the same key, and where no byte has changed. Files are written under another name and
/// renamed, so that several programs can use one folder. Where nothing can be written, nothing is stored.
class ReferenceCache {
 public:
  /// Keeps nothing.
  ReferenceCache() = default;
  /// Keeps results in a folder, and removes the least recently used ones above `most_bytes`.
  explicit ReferenceCache(std::filesystem::path folder, std::uintmax_t most_bytes = 256'000'000);

  /// Returns the cache of the user: $XDG_CACHE_HOME/substep, or ~/.cache/substep; without either, none.
  static ReferenceCache of_user();

  std::optional<Json> find(const std::string& key) const;
  void keep(const std::string& key, const Json& result) const;

 private:
  std::filesystem::path file_of(const std::string& key) const;
  void remove_oldest() const;

  std::filesystem::path folder_;
  std::uintmax_t most_bytes_ = 0;
  std::string program_;  ///< empty: nothing is kept
};

/// Convert a body's coordinates to an array of seven numbers, and back.
void to_json(Json& json, const Coordinates& q);
void from_json(const Json& json, Coordinates& q);

/// Returns reference_motion(), from the cache where it is stored. The scene must be unchanged since it was
/// loaded.
ReferenceMotion reference_motion(const Scene& scene, double duration, int threads,
                                 const ReferenceCache& cache);

}  // namespace substep
