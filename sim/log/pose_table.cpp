#include "sim/log/pose_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <utility>

#include "sim/error.h"
#include "sim/math/floating_point.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 15> columns{"t",  "body", "x",  "y",  "z",  "qw", "qx", "qy",
                                                   "qz", "vx",   "vy", "vz", "wx", "wy", "wz"};
constexpr std::size_t first_velocity = 9;
constexpr std::size_t absent = static_cast<std::size_t>(-1);
/// Most poses that are kept, in about 200 MB.
constexpr double most_poses = 2e6;
constexpr std::size_t longest_row = 1 << 16;

/// A reader of a CSV file row by row, which keeps one row in memory.
class Rows {
 public:
  explicit Rows(const fs::path& file) : what_(file.string()), stream_(file, std::ios::binary) {
    std::error_code ignored;
    if (!stream_ || fs::is_directory(file, ignored)) throw Error("{}: cannot be read", what_);
  }

  /// Reads the next row that is not blank. Returns false at the end.
  bool next() {
    do {
      line_ = lines_ + 1;
      if (stream_.peek() == std::ifstream::traits_type::eof()) return false;
      read_row();
    } while (fields_.size() == 1 && fields_[0].empty());
    return true;
  }

  const std::vector<std::string>& fields() const { return fields_; }

  double number(std::size_t field, std::string_view column) const {
    std::string_view text = fields_[field];
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
      refuse("{} '{}' is not a finite number", column, text.substr(0, 60));
    }
    return value;
  }

  template <typename... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> text, Args&&... args) const {
    throw Error("{}:{}: {}", what_, line_, fmt::format(text, std::forward<Args>(args)...));
  }

 private:
  void read_row() {
    fields_.assign(1, "");
    bool is_quoted = false;
    std::size_t length = 0;
    std::streambuf& bytes = *stream_.rdbuf();
    for (int c = bytes.sbumpc(); c != std::ifstream::traits_type::eof(); c = bytes.sbumpc()) {
      if (++length > longest_row) refuse("the row is longer than 65536 bytes: this is no pose table");
      if (c == '\n') ++lines_;
      std::string& field = fields_.back();
      if (is_quoted) {
        if (c != '"') {
          field += static_cast<char>(c);
        } else if (bytes.sgetc() == '"') {
          field += static_cast<char>(bytes.sbumpc());
        } else {
          is_quoted = false;
        }
      } else if (c == '"' && field.empty()) {
        is_quoted = true;
      } else if (c == ',') {
        fields_.emplace_back();
      } else if (c == '\n') {
        break;
      } else if (c != '\r' || bytes.sgetc() != '\n') {
        field += static_cast<char>(c);
      }
    }
    if (is_quoted) refuse("a quoted field has no closing quote");
  }

  std::string what_;
  std::ifstream stream_;
  std::vector<std::string> fields_;
  long long lines_ = 0;  ///< read to their ends
  long long line_ = 0;   ///< at which the row begins
};

struct Sample {
  double time = 0;
  Coordinates q;
  Velocity v;
};

class PoseTableReader {
 public:
  PoseTableReader(const fs::path& file, const Scene& scene, double step)
      : rows_(file), scene_(scene), step_(step), start_(initial_state(scene)), bodies_(scene.bodies.size()) {
    start_.contacts.clear();
    start_.patches.clear();
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      const auto [found, is_new] = indices_.emplace(scene.bodies[i].name, i);
      if (!is_new && (needs_rows(i) || needs_rows(found->second))) {
        throw Error("{}: two bodies of {} are called {}: a table cannot tell them apart", file.string(),
                    scene.name, found->first);
      }
    }
  }

  std::vector<State> read() {
    read_header();
    while (rows_.next()) read_row();
    const std::size_t frames = whole_frames();
    states_.resize(frames, start_);
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      if (bodies_[i].rows == 0) move_by_scene(i);
    }
    if (columns_[first_velocity] == absent) differentiate();
    return std::move(states_);
  }

 private:
  struct BodyRows {
    std::size_t rows = 0;
    std::size_t frames = 0;  ///< number of frames that have its pose
    Sample last;
  };

  bool needs_rows(std::size_t body) const { return !scene_.bodies[body].is_kinematic(); }

  void read_header() {
    if (!rows_.next()) rows_.refuse("the table is empty: a header is expected");
    std::vector<std::string> header = rows_.fields();
    if (header[0].starts_with("\xef\xbb\xbf")) header[0].erase(0, 3);
    columns_.fill(absent);
    for (std::size_t i = 0; i < header.size(); ++i) {
      const auto found = std::ranges::find(columns, header[i]);
      if (found == columns.end()) continue;
      std::size_t& column = columns_[static_cast<std::size_t>(found - columns.begin())];
      if (column != absent) rows_.refuse("the header has two columns {}", header[i]);
      column = i;
    }
    width_ = header.size();
    const bool has_velocities = std::any_of(columns_.begin() + first_velocity, columns_.end(),
                                            [](std::size_t column) { return column != absent; });
    std::vector<std::string_view> missing;
    for (std::size_t i = 0; i < (has_velocities ? columns.size() : first_velocity); ++i) {
      if (columns_[i] == absent) missing.push_back(columns[i]);
    }
    if (missing.empty()) return;
    rows_.refuse("the header lacks {}: '{}' are expected, in any order, and all velocities or none",
                 fmt::join(missing, ", "), fmt::join(columns, ","));
  }

  double value(std::size_t column) const { return rows_.number(columns_[column], columns[column]); }
  Vector3 vector(std::size_t column) const { return {value(column), value(column + 1), value(column + 2)}; }

  std::size_t body_of_row() const {
    const std::string& name = rows_.fields()[columns_[1]];
    if (const auto found = indices_.find(name); found != indices_.end()) return found->second;
    std::vector<std::string_view> known;
    for (std::size_t i = 1; i < scene_.bodies.size() && known.size() < 20; ++i) {
      known.push_back(scene_.bodies[i].name);
    }
    rows_.refuse("{} has no body '{}': there are {}{}", scene_.name, name.substr(0, 60),
                 fmt::join(known, ", "), known.size() + 1 < scene_.bodies.size() ? ", …" : "");
  }

  void read_row() {
    if (rows_.fields().size() != width_) {
      rows_.refuse("{} fields are expected as in the header, not {}", width_, rows_.fields().size());
    }
    const std::size_t index = body_of_row();
    const Body& body = scene_.bodies[index];
    Sample sample{value(0), {}, {}};
    sample.q.linear = vector(2);
    const Quaternion node(value(5), value(6), value(7), value(8));
    if (!(std::abs(node.norm() - 1) < 1e-3)) rows_.refuse("the quaternion is not of length 1");
    sample.q.angular = compose(node, body.body_from_node.orientation.conjugate());
    if (columns_[first_velocity] != absent) sample.v = {vector(9), vector(12)};
    add(index, sample);
  }

  void add(std::size_t index, Sample sample) {
    BodyRows& body = bodies_[index];
    const std::string& name = scene_.bodies[index].name;
    if (body.rows == 0 && !(std::abs(sample.time) <= 1e-6 * step_)) {
      rows_.refuse("{} begins at {} s: its first row must be at 0 s", name, sample.time);
    }
    if (body.rows > 0 && sample.time == body.last.time) {
      rows_.refuse("{} has two rows at {} s", name, sample.time);
    }
    if (body.rows > 0 && !(sample.time > body.last.time)) {
      rows_.refuse("{} goes from {} s back to {} s", name, body.last.time, sample.time);
    }
    // Interpolate along the shorter rotation.
    if (sample.q.angular.dot(body.last.q.angular) < 0) sample.q.angular.coeffs() *= -1;
    const double end = std::floor(sample.time / step_ + 1e-6) + 1;
    if (end * static_cast<double>(bodies_.size()) > most_poses) {
      rows_.refuse("{} s at steps of {:g} s are more than the {:g} poses that fit", sample.time, step_,
                   most_poses);
    }
    const auto frames = static_cast<std::size_t>(end);
    if (states_.size() < frames) states_.resize(frames, start_);
    for (; body.frames < frames; ++body.frames) {
      const double part =
          (static_cast<double>(body.frames) * step_ - body.last.time) / (sample.time - body.last.time);
      const bool is_here = std::abs(static_cast<double>(body.frames) * step_ - sample.time) <= 1e-6 * step_;
      State& state = states_[body.frames];
      state.q[index] = is_here ? sample.q
                               : Coordinates{(1 - part) * body.last.q.linear + part * sample.q.linear,
                                             turned(body.last.q.angular, sample.q.angular, part)};
      const Velocity& a = body.last.v;
      const Velocity& b = sample.v;
      state.v[index] = is_here ? b
                               : Velocity{(1 - part) * a.linear + part * b.linear,
                                          (1 - part) * a.angular + part * b.angular};
    }
    body.last = sample;
    ++body.rows;
  }

  static Quaternion turned(const Quaternion& from, const Quaternion& to, double part) {
    return compose(rotation_quaternion(part * rotation_vector(compose(to, from.conjugate()))), from);
  }

  /// Returns the number of frames in which all bodies have poses. Throws Error if a body lacks rows.
  std::size_t whole_frames() const {
    std::size_t frames = states_.size();
    std::size_t first = 0;
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      const std::string& name = scene_.bodies[i].name;
      if (bodies_[i].rows == 0 && !needs_rows(i)) continue;
      if (bodies_[i].rows == 0) rows_.refuse("the table ends without a row of {}", name);
      if (first == 0) first = i;
      if (bodies_[i].rows != bodies_[first].rows) {
        rows_.refuse("the table ends with {} rows of {} and {} of {}: every body needs a row at every time",
                     bodies_[first].rows, scene_.bodies[first].name, bodies_[i].rows, name);
      }
      frames = std::min(frames, bodies_[i].frames);
    }
    if (frames == 0) rows_.refuse("the table has no row");
    return frames;
  }

  void move_by_scene(std::size_t i) {
    for (std::size_t k = 0; k < states_.size(); ++k) {
      const double time = static_cast<double>(k) * step_;
      const Coordinates& q = start_.q[i];
      states_[k].q[i] = {q.linear + time * start_.v[i].linear,
                         compose(rotation_quaternion(time * start_.v[i].angular), q.angular)};
      states_[k].v[i] = start_.v[i];
    }
  }

  /// Sets velocities to central differences of poses, and the last ones to those of parabolas.
  void differentiate() {
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      if (bodies_[i].rows == 0) continue;
      states_[0].v[i] = start_.v[i];
      for (std::size_t k = 1; k < states_.size(); ++k) {
        const std::size_t next = std::min(k + 1, states_.size() - 1);
        const double time = static_cast<double>(next - (k - 1)) * step_;
        const Coordinates& a = states_[k - 1].q[i];
        const Coordinates& b = states_[next].q[i];
        Velocity& v = states_[k].v[i];
        v = {(b.linear - a.linear) / time, rotation_vector(compose(b.angular, a.angular.conjugate())) / time};
        if (next > k) continue;
        // The mean velocity is that of both ends.
        v.linear = 2 * v.linear - states_[k - 1].v[i].linear;
        v.angular = 2 * v.angular - states_[k - 1].v[i].angular;
      }
    }
  }

  Rows rows_;
  const Scene& scene_;
  double step_;
  State start_;
  std::map<std::string, std::size_t> indices_;
  std::vector<BodyRows> bodies_;
  std::array<std::size_t, columns.size()> columns_{};
  std::size_t width_ = 0;
  std::vector<State> states_;
};

}  // namespace

bool is_pose_table(const fs::path& file) {
  return file.extension() == ".csv";
}

std::vector<State> read_pose_table(const fs::path& file, const Scene& scene, double step) {
  const DefaultFloatingPoint environment;
  return PoseTableReader(file, scene, step).read();
}

PoseLog log_of(const std::vector<State>& states, const Scene& scene, double step, const std::string& author) {
  PoseLog log;
  log.scene = scene.file.filename().string();
  log.scene_hash = scene.hash;
  log.author = author;
  log.settings.step = step;
  for (const Body& body : scene.bodies) log.bodies.push_back(body.name);
  for (const State& state : states) log.frames.push_back({hash(state), state.q, state.v});
  return log;
}

PoseLog read_run(const fs::path& file, const Scene& scene, double step) {
  if (is_pose_table(file))
    return log_of(read_pose_table(file, scene, step), scene, step, file.stem().string());
  PoseLog log = read_pose_log(file);
  if (scene.hash != log.scene_hash) {
    throw Error("{}: was made from another version of {}, or with other options for a mesh: run it again",
                file.string(), scene.file.string());
  }
  if (scene.bodies.size() != log.bodies.size()) {
    throw Error("{}: has {} bodies, {} has {}", file.string(), log.bodies.size() - 1, scene.file.string(),
                scene.bodies.size() - 1);
  }
  return log;
}

}  // namespace substep
