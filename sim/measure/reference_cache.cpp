#include "sim/measure/reference_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/math/fnv1a.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view extension = ".reference";

/// Returns an environment variable's value where it is an absolute path, else an empty one.
fs::path path_in(const char* variable) {
  const char* const value = std::getenv(variable);
  return value != nullptr && fs::path(value).is_absolute() ? fs::path(value) : fs::path();
}

}  // namespace

std::optional<std::uint64_t> program_hash() {
  static const std::optional<std::uint64_t> hash = []() -> std::optional<std::uint64_t> {
    const auto content = content_of("/proc/self/exe");
    if (!content || content->empty()) return std::nullopt;
    return fnv1a(*content);
  }();
  return hash;
}

ReferenceCache::ReferenceCache(fs::path folder, std::uintmax_t most_bytes)
    : folder_(std::move(folder)), most_bytes_(most_bytes) {
  if (const auto hash = program_hash()) program_ = fmt::format("program {:016x} ", *hash);
}

ReferenceCache ReferenceCache::of_user() {
  fs::path folder = path_in("XDG_CACHE_HOME");
  if (folder.empty() && !path_in("HOME").empty()) folder = path_in("HOME") / ".cache";
  return folder.empty() ? ReferenceCache() : ReferenceCache(folder / "substep");
}

fs::path ReferenceCache::file_of(const std::string& key) const {
  return folder_ / fmt::format("{:016x}{}", fnv1a(key, fnv1a(program_)), extension);
}

/// Returns a cached result. A file holds the hash of its rest in 16 digits, then, as CBOR, the key and the
/// result.
std::optional<Json> ReferenceCache::find(const std::string& key) const {
  constexpr std::size_t digits = 16;
  if (program_.empty()) return std::nullopt;
  const fs::path file = file_of(key);
  const std::string content = content_of(file).value_or("");
  if (content.size() <= digits) return std::nullopt;
  const std::string_view body = std::string_view(content).substr(digits);
  if (content.compare(0, digits, fmt::format("{:016x}", fnv1a(body))) != 0) return std::nullopt;
  Json entry = Json::from_cbor(body, true, false);
  if (!entry.is_array() || entry.size() != 2 || entry[0] != program_ + key) return std::nullopt;
  std::error_code ignored;
  fs::last_write_time(file, fs::file_time_type::clock::now(), ignored);
  return std::move(entry[1]);
}

void ReferenceCache::keep(const std::string& key, const Json& result) const {
  if (program_.empty()) return;
  std::error_code failure;
  fs::create_directories(folder_, failure);
  if (failure) return;
  std::string body;
  Json::to_cbor(Json::array({program_ + key, result}), body);
  if (body.size() > most_bytes_) return;
  try {
    write_file(file_of(key), fmt::format("{:016x}{}", fnv1a(body), body));
  } catch (const Error&) {
    return;  // a full disk, or no right to write: it is computed again next time
  }
  remove_oldest();
}

void ReferenceCache::remove_oldest() const {
  struct Entry {
    fs::file_time_type used;
    std::uintmax_t bytes;
    fs::path file;
  };
  std::vector<Entry> entries;
  std::uintmax_t sum = 0;
  std::error_code failure;
  for (fs::directory_iterator at(folder_, failure), end; !failure && at != end; at.increment(failure)) {
    std::error_code gone;  // another program may remove files meanwhile
    const Entry entry{at->last_write_time(gone), at->file_size(gone), at->path()};
    if (gone || entry.file.extension() != extension) continue;
    sum += entry.bytes;
    entries.push_back(entry);
  }
  std::ranges::sort(entries, {}, &Entry::used);
  for (const Entry& entry : entries) {
    if (sum <= most_bytes_) break;
    fs::remove(entry.file, failure);
    sum -= entry.bytes;
  }
}

void to_json(Json& json, const Coordinates& q) {
  json = {q.linear.x(),  q.linear.y(),  q.linear.z(), q.angular.x(),
          q.angular.y(), q.angular.z(), q.angular.w()};
}

void from_json(const Json& json, Coordinates& q) {
  const auto numbers = json.get<std::array<double, 7>>();
  q.linear = Vector3(numbers.data());
  q.angular.coeffs() = Eigen::Vector4d(numbers.data() + 3);
}

static void to_json(Json& json, const Velocity& v) {
  json = {v.linear.x(), v.linear.y(), v.linear.z(), v.angular.x(), v.angular.y(), v.angular.z()};
}

static void from_json(const Json& json, Velocity& v) {
  const auto numbers = json.get<std::array<double, 6>>();
  v = {Vector3(numbers.data()), Vector3(numbers.data() + 3)};
}

// NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE for Json: version 3.11.2 has it for the type with sorted keys alone.
#define SUBSTEP_JSON_FIELDS(Type, ...)                                         \
  static void to_json(Json& nlohmann_json_j, const Type& nlohmann_json_t) {    \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_TO, __VA_ARGS__))   \
  }                                                                            \
  static void from_json(const Json& nlohmann_json_j, Type& nlohmann_json_t) {  \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_FROM, __VA_ARGS__)) \
  }
SUBSTEP_JSON_FIELDS(State, q, v)
SUBSTEP_JSON_FIELDS(Motion, interval, samples)
SUBSTEP_JSON_FIELDS(Uncertainty, position, turn)
SUBSTEP_JSON_FIELDS(ReferenceMotion, motion, method, horizon, divergence_point, uncertainties)

ReferenceMotion reference_motion(const Scene& scene, double duration, int threads,
                                 const ReferenceCache& cache) {
  const std::string key = fmt::format("reference_motion {:016x} {} {}", scene.hash, scene.step, duration);
  if (const auto kept = cache.find(key)) return kept->get<ReferenceMotion>();
  ReferenceMotion reference = reference_motion(scene, duration, threads);
  cache.keep(key, reference);
  return reference;
}

}  // namespace substep
