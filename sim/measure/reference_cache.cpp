#include "sim/measure/reference_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
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

nlohmann::json to_json(const std::vector<Velocity>& velocities) {
  const auto values = components(velocities);
  return std::vector<double>(values.begin(), values.end());
}

std::vector<Velocity> velocities_in(const nlohmann::json& json) {
  const auto values = json.get<std::vector<double>>();
  std::vector<Velocity> velocities(values.size() / 6);
  std::ranges::copy(values, components(velocities).begin());
  return velocities;
}

nlohmann::json to_json(const ReferenceMotion& reference) {
  nlohmann::json samples;
  for (const State& state : reference.motion.samples)
    samples.push_back({substep::to_json(state.q), to_json(state.v)});
  nlohmann::json uncertainties;
  for (const Uncertainty& one : reference.uncertainties) uncertainties.push_back({one.position, one.turn});
  return {{"interval", reference.motion.interval},
          {"samples", std::move(samples)},
          {"method", reference.method},
          {"uncertainty", reference.uncertainty},
          {"turn uncertainty", reference.turn_uncertainty},
          {"horizon", reference.horizon},
          {"divergence point", reference.divergence_point},
          {"uncertainties", std::move(uncertainties)}};
}

ReferenceMotion reference_in(const nlohmann::json& json) {
  ReferenceMotion reference;
  json.at("interval").get_to(reference.motion.interval);
  for (const nlohmann::json& sample : json.at("samples")) {
    State& state = reference.motion.samples.emplace_back();
    state.q = coordinates_in(sample[0]);
    state.v = velocities_in(sample[1]);
  }
  json.at("method").get_to(reference.method);
  json.at("uncertainty").get_to(reference.uncertainty);
  json.at("turn uncertainty").get_to(reference.turn_uncertainty);
  json.at("horizon").get_to(reference.horizon);
  json.at("divergence point").get_to(reference.divergence_point);
  for (const nlohmann::json& one : json.at("uncertainties"))
    reference.uncertainties.push_back({one[0].get<double>(), one[1].get<double>()});
  return reference;
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

/// A file holds the hash of what follows in 16 digits, then, as CBOR, the key and the result.
std::optional<nlohmann::json> ReferenceCache::find(const std::string& key) const {
  constexpr std::size_t digits = 16;
  if (program_.empty()) return std::nullopt;
  const fs::path file = file_of(key);
  const std::string content = content_of(file).value_or("");
  if (content.size() <= digits) return std::nullopt;
  const std::string_view body = std::string_view(content).substr(digits);
  if (content.compare(0, digits, fmt::format("{:016x}", fnv1a(body))) != 0) return std::nullopt;
  nlohmann::json entry = nlohmann::json::from_cbor(body, true, false);
  if (!entry.is_array() || entry.size() != 2 || entry[0] != program_ + key) return std::nullopt;
  std::error_code ignored;
  fs::last_write_time(file, fs::file_time_type::clock::now(), ignored);
  return std::move(entry[1]);
}

void ReferenceCache::keep(const std::string& key, const nlohmann::json& result) const {
  if (program_.empty()) return;
  std::error_code failure;
  fs::create_directories(folder_, failure);
  if (failure) return;
  std::string body;
  nlohmann::json::to_cbor(nlohmann::json::array({program_ + key, result}), body);
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

nlohmann::json to_json(const std::vector<Coordinates>& coordinates) {
  std::vector<double> numbers;
  for (const Coordinates& one : coordinates) {
    numbers.insert(numbers.end(), one.linear.begin(), one.linear.end());
    numbers.insert(numbers.end(), one.angular.coeffs().begin(), one.angular.coeffs().end());
  }
  return numbers;
}

std::vector<Coordinates> coordinates_in(const nlohmann::json& json) {
  const auto numbers = json.get<std::vector<double>>();
  std::vector<Coordinates> coordinates(numbers.size() / 7);
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const double* const at = numbers.data() + 7 * i;
    coordinates[i].linear = Vector3(at);
    coordinates[i].angular.coeffs() = Eigen::Vector4d(at + 3);
  }
  return coordinates;
}

ReferenceMotion reference_motion(const Scene& scene, double duration, int threads,
                                 const ReferenceCache& cache) {
  const std::string key = fmt::format("reference_motion {:016x} {} {}", scene.hash, scene.step, duration);
  if (const auto kept = cache.find(key)) return reference_in(*kept);
  ReferenceMotion reference = reference_motion(scene, duration, threads);
  cache.keep(key, to_json(reference));
  return reference;
}

}  // namespace substep
