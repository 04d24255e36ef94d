#include "golden/compare/track.h"

#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <set>

#include "golden/compare/provenance.h"
#include "render/image.h"
#include "sim/error.h"
#include "sim/measure/invariants.h"

namespace substep::golden {
namespace {

constexpr std::string_view magic = "substep track 1\n";
constexpr int components = 7;
constexpr std::uint64_t largest_track = 1U << 30;

std::uint16_t digest(const Coordinates& q, const Velocity& v) {
  return Digest().add(q.linear, q.angular.coeffs(), v.linear, v.angular).value();
}

/// Returns a component in the order of a pose log: x y z, w x y z.
double& component(Coordinates& q, int i) {
  return i < 3 ? q.linear[i] : q.angular.coeffs()[i % 4];
}
double component(const Coordinates& q, int i) {
  return i < 3 ? q.linear[i] : q.angular.coeffs()[i % 4];
}

std::int64_t to_units(double value) {
  constexpr double farthest = 1e12;  // far from where a sum of two differences overflows
  return std::llround(std::clamp(value, -farthest, farthest) / Track::resolution);
}

Coordinates rounded(Coordinates q) {
  for (int i = 0; i < components; ++i)
    component(q, i) = static_cast<double>(to_units(component(q, i))) * Track::resolution;
  return q;
}

void put(std::string& bytes, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(value | 0x80);
  bytes += static_cast<char>(value);
}

void put_signed(std::string& bytes, std::int64_t value) {
  put(bytes, static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63));
}

class Input {
 public:
  Input(std::string_view bytes, const std::string& what) : rest_(bytes), what_(what) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      if (rest_.empty()) break;
      const auto byte = static_cast<std::uint8_t>(rest_.front());
      rest_.remove_prefix(1);
      value |= std::uint64_t{byte & 0x7fU} << shift;
      if (byte < 0x80) return value;
    }
    refuse();
  }
  /// Returns a signed number in two's complement.
  std::uint64_t signed_number() {
    const std::uint64_t value = number();
    return value >> 1 ^ (~(value & 1) + 1);
  }
  /// Returns a number of items of at least `bytes` each. Throws Error where fewer bytes are left: a damaged
  /// file must not request all memory.
  std::size_t count(std::size_t bytes) {
    const std::uint64_t value = number();
    if (value > rest_.size() / bytes) refuse();
    return static_cast<std::size_t>(value);
  }
  float real() {
    const std::uint64_t bits = number();
    if (bits >> 32 != 0) refuse();
    return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  }
  std::string_view rest() const { return rest_; }
  void expect_end() const {
    if (!rest_.empty()) refuse();
  }

 private:
  [[noreturn]] void refuse() const { throw Error("{}: is damaged", what_); }
  std::string_view rest_;
  const std::string& what_;
};

std::string packed(const Track& track) {
  const std::size_t bodies = track.frames.empty() ? 0 : track.frames.front().poses.size();
  std::string bytes;
  put(bytes, track.frames.size());
  put(bytes, bodies);
  // Second differences of smooth motion are small, and equal while a body flies or rests.
  for (std::size_t body = 1; body < bodies; ++body) {
    for (int i = 0; i < components; ++i) {
      std::int64_t last = 0;
      std::int64_t slope = 0;
      for (const Track::Frame& frame : track.frames) {
        const std::int64_t value = to_units(component(frame.poses[body], i));
        put_signed(bytes, value - last - slope);
        slope = value - last;
        last = value;
      }
    }
  }
  for (std::size_t body = 1; body < bodies; ++body) {
    for (const Track::Frame& frame : track.frames) put(bytes, frame.digests[body]);
  }
  for (const Track::Frame& frame : track.frames) {
    const Invariants& kept = frame.invariants;
    put(bytes, kept.touching);
    put(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(kept.energy)));
    put(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(kept.penetration)));
    put(bytes, static_cast<std::uint64_t>(kept.resting));
  }
  return bytes;
}

Track unpacked(std::string_view bytes, const std::string& what) {
  Input input(bytes, what);
  Track track;
  track.frames.resize(input.count(1));
  const std::size_t bodies = input.count(std::max<std::size_t>(track.frames.size(), 1));
  for (Track::Frame& frame : track.frames) {
    frame.poses.resize(bodies);
    frame.digests.resize(bodies);
  }
  for (std::size_t body = 1; body < bodies; ++body) {
    for (int i = 0; i < components; ++i) {
      std::uint64_t last = 0;
      std::uint64_t slope = 0;
      for (Track::Frame& frame : track.frames) {
        const std::uint64_t value = last + slope + input.signed_number();
        component(frame.poses[body], i) =
            static_cast<double>(static_cast<std::int64_t>(value)) * Track::resolution;
        slope = value - last;
        last = value;
      }
    }
  }
  for (std::size_t body = 1; body < bodies; ++body) {
    for (Track::Frame& frame : track.frames) {
      frame.digests[body] = static_cast<std::uint16_t>(input.number());
    }
  }
  for (Track::Frame& frame : track.frames) {
    frame.invariants.touching = static_cast<std::uint16_t>(input.number());
    frame.invariants.energy = input.real();
    frame.invariants.penetration = input.real();
    frame.invariants.resting = static_cast<int>(input.number());
  }
  input.expect_end();
  return track;
}

}  // namespace

Tracker::Tracker(const Scene& scene, const Settings& settings)
    : scene_(scene), settings_(settings), model_(build_model(scene)), finder_(scene_, model_) {}

void Tracker::add(const State& state) {
  Track::Frame frame;
  frame.poses.resize(state.q.size());
  frame.digests.resize(state.q.size());
  for (std::size_t i = 1; i < state.q.size(); ++i) {
    frame.poses[i] = rounded(state.q[i]);
    frame.digests[i] = digest(state.q[i], state.v[i]);
  }
  frame.invariants = invariants(state);
  track_.frames.push_back(std::move(frame));
}

Invariants Tracker::invariants(const State& state) {
  Invariants result;
  result.energy = energy(scene_, state);
  for (std::size_t i = 1; i < state.v.size(); ++i) {
    const bool is_slow =
        state.v[i].linear.norm() < Track::resting_speed && state.v[i].angular.norm() < Track::resting_speed;
    if (is_slow) ++result.resting;
  }
  if (!model_.contacts) return result;
  std::set<std::pair<int, int>> pairs;
  State without_patches = state;  // kept ones stand for contacts that are not found anew
  without_patches.patches.clear();
  for (const Contact& contact : finder_.find(without_patches, settings_.step, 1)) {
    const Coordinates& a = state.q[static_cast<std::size_t>(contact.a)];
    const Coordinates& b = state.q[static_cast<std::size_t>(contact.b)];
    const Vector3 offset = a.linear + a.angular * contact.arm_a - b.linear - b.angular * contact.arm_b;
    const double gap = offset.dot(b.angular * contact.normal_b);
    result.penetration = std::max(result.penetration, -gap);
    if (gap < Track::touching_gap) pairs.insert(std::minmax(contact.a, contact.b));
  }
  result.penetration = std::round(1e4 * result.penetration) / 1e4;
  Digest digest;
  for (const auto& [a, b] : pairs) digest.add(static_cast<double>(a), static_cast<double>(b));
  result.touching = digest.value();
  return result;
}

std::string to_bytes(const Track& track) {
  const std::string raw = packed(track);
  std::string bytes(magic);
  put(bytes, raw.size());
  return bytes + render::zlib_compressed(raw, 9);
}

Track read_track(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  const std::string what = file.string();
  const auto refuse = [&] { throw Error("{}: is not a track", what); };
  std::string_view rest = bytes;
  if (rest.substr(0, magic.size()) != magic) refuse();
  rest.remove_prefix(magic.size());
  Input header(rest, what);
  const std::uint64_t size = header.number();
  rest = header.rest();
  if (size > largest_track) refuse();
  std::string raw(size, '\0');
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  const auto result = libdeflate_zlib_decompress(decompressor.get(), rest.data(), rest.size(), raw.data(),
                                                 raw.size(), nullptr);
  if (result != LIBDEFLATE_SUCCESS) refuse();
  return unpacked(raw, what);
}

}  // namespace substep::golden
