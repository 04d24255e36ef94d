#include "sim/log/pose_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>

#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/math/floating_point.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

constexpr std::string_view first_line = "substep pose log 1";
constexpr std::string_view units_line = "units metres seconds radians";

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f || c == '\\') {
      result += fmt::format("\\x{:02x}", byte);
    } else {
      result += c;
    }
  }
  return result;
}

/// A binary file has lines of megabytes and bytes that would upset a terminal.
std::string shortened(std::string_view text) {
  return escaped(text.substr(0, 60)) + (text.size() > 60 ? "…" : "");
}

template <typename Number>
std::optional<Number> number_in(std::string_view text, int base = 10) {
  Number value{};
  std::from_chars_result result{};
  if constexpr (std::is_floating_point_v<Number>) {
    result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (!std::isfinite(value)) return std::nullopt;
  } else {
    result = std::from_chars(text.data(), text.data() + text.size(), value, base);
  }
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::string> unescaped(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\') {
      result += text[i];
      continue;
    }
    if (i + 3 >= text.size() || text[i + 1] != 'x') return std::nullopt;
    const auto byte = number_in<unsigned char>(text.substr(i + 2, 2), 16);
    if (!byte) return std::nullopt;
    result += static_cast<char>(*byte);
    i += 3;
  }
  return result;
}

/// Goes through the lines of a log and refuses what is not as expected, naming the line.
class Reader {
 public:
  Reader(std::string_view text, const std::string& what) : rest_(text), what_(what) {}

  bool at_end() const { return rest_.empty(); }

  /// Takes the next line; `expected` is for the message when there is none.
  void next(std::string_view expected) {
    if (rest_.empty()) {
      ++line_number_;
      refuse(fmt::format("the log ends where '{}' is expected: it is truncated, run it again", expected));
    }
    const std::size_t length = rest_.find('\n');
    ++line_number_;
    if (length == std::string_view::npos) refuse("the line has no end: the log is truncated, run it again");
    line_ = rest_.substr(0, length);
    rest_.remove_prefix(length + 1);
  }

  bool starts_with(std::string_view key) const {
    return line_.substr(0, key.size()) == key && line_.substr(key.size(), 1) == " ";
  }

  std::string_view line() const { return line_; }

  /// Returns the text after `key` and a space in the current line. Throws Error without them.
  std::string_view after(std::string_view key) const {
    if (!starts_with(key)) refuse(fmt::format("'{} …' is expected, not '{}'", key, shortened(line_)));
    return line_.substr(key.size() + 1);
  }

  bool is_next(std::string_view key) const { return rest_.starts_with(key); }

  template <typename Number>
  Number number(std::string_view text, std::string_view of, int base = 10) const {
    const auto value = number_in<Number>(text, base);
    if (!value) refuse(fmt::format("'{}' is not a number that {} can be", shortened(text), of));
    return *value;
  }

  std::string name(std::string_view text) const {
    auto result = unescaped(text);
    if (!result) refuse("a backslash must be followed by x and two hexadecimal digits");
    return *std::move(result);
  }

  std::uint64_t hash(std::string_view text) const {
    if (text.size() != 16)
      refuse(fmt::format("'{}' is not a hash of 16 hexadecimal digits", shortened(text)));
    return number<std::uint64_t>(text, "a hash", 16);
  }

  /// The words of `text`, which must be `count`, parted by single spaces.
  template <std::size_t count>
  std::array<std::string_view, count> words(std::string_view text) const {
    std::array<std::string_view, count> result;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t length = i + 1 < count ? text.find(' ') : text.size();
      if (length == std::string_view::npos || text.substr(0, length).empty()) {
        refuse(fmt::format("{} items are expected, not '{}'", count, shortened(line_)));
      }
      result[i] = text.substr(0, length);
      text.remove_prefix(std::min(text.size(), length + 1));
    }
    return result;
  }

  [[noreturn]] void refuse(const std::string& sentence) const {
    throw Error(fmt::format("{}:{}: {}", what_, line_number_, sentence));
  }

 private:
  std::string_view rest_;
  std::string what_;
  std::string_view line_;
  int line_number_ = 0;
};

/// Whether a setting of the run is known.
bool has_field(const PoseLog& log, const SettingsField& field) {
  return log.author.empty() || field.name == "step";
}

void read_header(Reader& reader, PoseLog& log) {
  const auto value = [&reader](std::string_view key) {
    reader.next(key);
    return reader.after(key);
  };

  reader.next(first_line);
  if (reader.line() != first_line) {
    if (reader.starts_with("substep pose log")) {
      reader.refuse(fmt::format("version {} of the pose log is unknown here: this program reads version 1",
                                escaped(reader.after("substep pose log").substr(0, 20))));
    }
    reader.refuse(fmt::format("this is no pose log: its first line would be '{}'", first_line));
  }
  reader.next(units_line);
  if (reader.line() != units_line) reader.refuse(fmt::format("'{}' is expected", units_line));
  log.scene = reader.name(value("scene"));
  log.scene_hash = reader.hash(value("scene-hash"));
  if (reader.is_next("author ")) log.author = reader.name(value("author"));
  for (const SettingsField& field : settings_fields) {
    if (!has_field(log, field)) continue;
    // Logs from before there was the field go on being read: it is as in Settings{}.
    const bool may_lack = field.can_be_left_out || !field.stands_in_for.empty();
    if (may_lack && !reader.is_next(field.name)) continue;
    const std::string_view text = value(field.name);
    if (set(log.settings, field, text)) continue;
    reader.refuse(fmt::format("{} '{}': must be {}", field.name, shortened(text), kind_of(field)));
  }
  try {
    check(log.settings);
  } catch (const Error& error) {
    reader.refuse(error.what());
  }
  log.modelled = reader.name(value("modelled"));

  log.bodies = {"world"};
  for (reader.next("body"); reader.starts_with("body"); reader.next("full-every")) {
    const std::string_view text = reader.after("body");
    const std::size_t space = std::min(text.find(' '), text.size());
    const int index = reader.number<int>(text.substr(0, space), "a body's index");
    if (index != static_cast<int>(log.bodies.size())) {
      reader.refuse(fmt::format("body {} is expected here, not {}", log.bodies.size(), index));
    }
    log.bodies.push_back(reader.name(text.substr(std::min(text.size(), space + 1))));
  }
  log.full_every = reader.number<int>(reader.after("full-every"), "full-every");
  if (log.full_every < 1) reader.refuse("full-every must be at least 1");
}

/// The poses under a frame's line; leaves the reader at the first line that is none.
void read_poses(Reader& reader, PoseLog& log) {
  PoseLog::Frame& frame = log.frames.back();
  for (reader.next("end"); reader.starts_with("pose"); reader.next("end")) {
    const auto words = reader.words<8>(reader.after("pose"));
    if (frame.poses.empty()) frame.poses.emplace_back();
    const int body = reader.number<int>(words[0], "a body's index");
    if (body != static_cast<int>(frame.poses.size()) || frame.poses.size() >= log.bodies.size()) {
      reader.refuse(
          frame.poses.size() < log.bodies.size()
              ? fmt::format("the pose of body {} is expected here, not of {}", frame.poses.size(), body)
              : fmt::format("a pose too many: there are {} bodies", log.bodies.size() - 1));
    }
    std::array<double, 7> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = reader.number<double>(words[i + 1], "a coordinate");
    }
    Coordinates pose;
    pose.linear = Vector3(values[0], values[1], values[2]);
    pose.angular = Quaternion(values[3], values[4], values[5], values[6]);
    if (!(std::abs(pose.angular.norm() - 1) < 1e-6)) reader.refuse("the quaternion is not of length 1");
    frame.poses.push_back(pose);
  }
  if (!frame.poses.empty() && frame.poses.size() != log.bodies.size()) {
    reader.refuse(fmt::format("the pose of body {} is missing", frame.poses.size()));
  }
}

void read_frames(Reader& reader, PoseLog& log) {
  reader.next("frame");
  while (reader.starts_with("frame")) {
    const auto words = reader.words<2>(reader.after("frame"));
    const int number = reader.number<int>(words[0], "a frame");
    if (number != static_cast<int>(log.frames.size())) {
      reader.refuse(fmt::format("frame {} is expected here, not {}", log.frames.size(), number));
    }
    log.frames.push_back({reader.hash(words[1]), {}});
    read_poses(reader, log);
    const bool last = !reader.starts_with("frame");
    const bool must_be_full = log.bodies.size() > 1 && (number % log.full_every == 0 || last);
    if (must_be_full == log.frames.back().poses.empty()) {
      reader.refuse(fmt::format("frame {} {} poses", number, must_be_full ? "must have" : "must have no"));
    }
  }
  if (log.frames.empty()) reader.refuse("'frame 0 …' is expected");
}

void read_end(Reader& reader, PoseLog& log) {
  const std::string_view text = reader.after("end");
  const std::size_t space = std::min(text.find(' '), text.size());
  const std::string_view kind = text.substr(0, space);
  const int last = static_cast<int>(log.frames.size()) - 1;
  const std::string_view rest = text.substr(std::min(text.size(), space + 1));
  const int step = reader.number<int>(rest.substr(0, rest.find(' ')), "a frame");
  if (kind == "ok" && rest == fmt::to_string(last)) {
    log.end = "ok";
  } else if ((kind == "diverged" && step == last + 1) || (kind == "unsolved" && step >= 1 && step <= last)) {
    log.end = reader.name(text);
  } else {
    reader.refuse(
        fmt::format("an end that fits frame {} as the last is expected, as 'end ok {}'", last, last));
  }
  if (!reader.at_end()) {
    reader.next("");
    reader.refuse("nothing may follow the line 'end'");
  }
}

std::string header_differences(const PoseLog& expected, const PoseLog& actual) {
  std::string result;
  const auto line = [&result](std::string_view what, const auto& a, const auto& b) {
    if (a != b) result += fmt::format("{}: {} → {}\n", what, a, b);
  };
  line("scene", expected.scene, actual.scene);
  line("scene-hash", fmt::format("{:016x}", expected.scene_hash), fmt::format("{:016x}", actual.scene_hash));
  line("author", expected.author, actual.author);
  for (const SettingsField& field : settings_fields) {
    if (!has_field(expected, field) || !has_field(actual, field)) continue;
    line(field.name, text_of(expected.settings, field), text_of(actual.settings, field));
  }
  line("modelled", expected.modelled, actual.modelled);
  line("bodies", expected.bodies.size() - 1, actual.bodies.size() - 1);
  const std::size_t bodies = std::min(expected.bodies.size(), actual.bodies.size());
  for (std::size_t i = 0; i < bodies; ++i) {
    line(fmt::format("body {}", i), expected.bodies[i], actual.bodies[i]);
  }
  line("full-every", expected.full_every, actual.full_every);
  line("last frame", expected.frames.size() - 1, actual.frames.size() - 1);
  line("end", expected.end, actual.end);
  if (!result.empty()) result.pop_back();
  return result;
}

std::string header_text(const PoseLog& log) {
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out, "{}\n{}\n", first_line, units_line);
  fmt::format_to(out, "scene {}\nscene-hash {:016x}\n", escaped(log.scene), log.scene_hash);
  if (!log.author.empty()) fmt::format_to(out, "author {}\n", escaped(log.author));
  for (const SettingsField& field : settings_fields) {
    if (!has_field(log, field) || field.is_left_out(log.settings)) continue;
    fmt::format_to(out, "{} {}\n", field.name, text_of(log.settings, field));
  }
  fmt::format_to(out, "modelled {}\n", escaped(log.modelled));
  for (std::size_t i = 1; i < log.bodies.size(); ++i) {
    fmt::format_to(out, "body {} {}\n", i, escaped(log.bodies[i]));
  }
  fmt::format_to(out, "full-every {}\n", log.full_every);
  return text;
}

void add_text(std::string& text, int number, const PoseLog::Frame& frame) {
  auto out = std::back_inserter(text);
  fmt::format_to(out, "frame {} {:016x}\n", number, frame.hash);
  for (std::size_t i = 1; i < frame.poses.size(); ++i) {
    const Vector3& x = frame.poses[i].linear;
    const Quaternion& r = frame.poses[i].angular;
    fmt::format_to(out, "pose {} {} {} {} {} {} {} {}\n", i, x.x(), x.y(), x.z(), r.w(), r.x(), r.y(), r.z());
  }
}

std::string end_text(const std::string& end, int last) {
  return end == "ok" ? fmt::format("end ok {}\n", last) : fmt::format("end {}\n", escaped(end));
}

/// Returns the header of a log.
PoseLog header_of(const Simulation& simulation, int full_every) {
  const Scene& scene = simulation.scene();
  PoseLog log;
  log.scene = scene.file.filename().string();
  log.scene_hash = scene.hash;
  log.settings = simulation.settings();
  log.modelled = simulation.modelled();
  for (const Body& body : scene.bodies) log.bodies.push_back(body.name);
  log.full_every = full_every;
  return log;
}

/// Steps and hands over the frames in order, each when it is known whether it is the last, which is full.
/// Returns how the run ended.
std::string run(Simulation& simulation, int frames, int full_every, const AfterFrame& after_frame,
                const std::function<void(PoseLog::Frame)>& take) {
  if (frames < 0) throw Error(fmt::format("{} frames cannot be run", frames));
  if (full_every < 1) throw Error(fmt::format("full poses every {} frames: must be at least 1", full_every));
  const auto frame_of = [&](bool full) {
    return PoseLog::Frame{hash(simulation.state()), full ? simulation.state().q : std::vector<Coordinates>{}};
  };
  PoseLog::Frame latest = frame_of(true);
  int first_unsolved = 0;
  int unsolved = 0;
  for (int k = 1; k <= frames; ++k) {
    const StepReport& report = simulation.step();
    if (report.status == StepReport::Status::diverged) {
      latest.poses = simulation.state().q;
      take(std::move(latest));
      const auto body = static_cast<std::size_t>(report.diverged_body);
      return fmt::format("diverged {} body {} {}", k, body, simulation.scene().bodies[body].name);
    }
    if (report.status == StepReport::Status::unsolved && unsolved++ == 0) first_unsolved = k;
    take(std::exchange(latest, frame_of(k % full_every == 0 || k == frames)));
    if (after_frame) after_frame(k, report);
  }
  take(std::move(latest));
  return unsolved == 0 ? "ok" : fmt::format("unsolved {} steps {}", first_unsolved, unsolved);
}

bool same_poses(const PoseLog::Frame& a, const PoseLog::Frame& b) {
  const std::size_t bodies = std::min(a.poses.size(), b.poses.size());
  for (std::size_t i = 1; i < bodies; ++i) {
    if (a.poses[i].linear != b.poses[i].linear) return false;
    if (a.poses[i].angular.coeffs() != b.poses[i].angular.coeffs()) return false;
  }
  return true;
}

}  // namespace

PoseLog parse_pose_log(std::string_view text, const std::string& what) {
  const DefaultFloatingPoint environment;
  PoseLog log;
  Reader reader(text, what);
  read_header(reader, log);
  read_frames(reader, log);
  read_end(reader, log);
  return log;
}

PoseLog read_pose_log(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored))
    throw Error(fmt::format("{}: there is no such file", file.string()));
  if (std::filesystem::is_directory(file, ignored)) {
    throw Error(fmt::format("{}: is a folder, not a pose log", file.string()));
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(fmt::format("{}: cannot be read", file.string()));
  // Read the first bytes alone, since the file may be an endless device.
  std::string text(60, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  constexpr std::string_view start = "substep pose log";
  if (text.size() > start.size() && !text.starts_with(start))
    return parse_pose_log(text + '\n', file.string());
  if (stream) text.append(std::istreambuf_iterator<char>(stream), {});
  if (stream.bad()) throw Error(fmt::format("{}: cannot be read to its end", file.string()));
  return parse_pose_log(text, file.string());
}

std::string to_text(const PoseLog& log) {
  std::string text = header_text(log);
  for (std::size_t k = 0; k < log.frames.size(); ++k) add_text(text, static_cast<int>(k), log.frames[k]);
  return text + end_text(log.end, static_cast<int>(log.frames.size()) - 1);
}

PoseLog record(Simulation& simulation, int frames, int full_every, const AfterFrame& after_frame) {
  PoseLog log = header_of(simulation, full_every);
  log.end = run(simulation, frames, full_every, after_frame,
                [&log](PoseLog::Frame frame) { log.frames.push_back(std::move(frame)); });
  return log;
}

WrittenRun record_to(const std::filesystem::path& file, Simulation& simulation, int frames, int full_every,
                     const AfterFrame& after_frame) {
  OutputFile output(file);
  output.write(header_text(header_of(simulation, full_every)));
  WrittenRun result;
  result.last_frame = -1;
  std::string text;
  result.end = run(simulation, frames, full_every, after_frame, [&](const PoseLog::Frame& frame) {
    text.clear();
    add_text(text, ++result.last_frame, frame);
    output.write(text);
  });
  output.write(end_text(result.end, result.last_frame));
  output.publish();
  return result;
}

BodyDifference difference(const Coordinates& a, const Coordinates& b) {
  BodyDifference result;
  const Vector3 offset = (a.linear - b.linear).cwiseAbs();
  Eigen::Index axis = 0;
  result.position = offset.maxCoeff(&axis);
  // From the vector part: the angle between nearly equal quaternions keeps its digits.
  const Quaternion between = a.angular.conjugate() * b.angular;
  result.orientation = 2 * std::atan2(between.vec().norm(), std::abs(between.w()));
  if (a.angular.coeffs() == b.angular.coeffs() || a.angular.coeffs() == -b.angular.coeffs()) {
    result.orientation = 0;
  }
  if (result.position > 0) {
    result.axis = "xyz"[axis];
  } else if (result.orientation > 0) {
    result.axis = 'r';
  }
  return result;
}

PoseDifference compare(const PoseLog& expected, const PoseLog& actual) {
  PoseDifference result;
  BodyDifference largest;  // in the first full frame
  result.headers = header_differences(expected, actual);
  const std::size_t common = std::min(expected.frames.size(), actual.frames.size());
  for (std::size_t k = 0; k < common; ++k) {
    const PoseLog::Frame& a = expected.frames[k];
    const PoseLog::Frame& b = actual.frames[k];
    if (result.first_frame < 0 && a.hash != b.hash) result.first_frame = static_cast<int>(k);
    if (result.first_contradiction < 0 && a.hash == b.hash && !same_poses(a, b)) {
      result.first_contradiction = static_cast<int>(k);
    }
    const std::size_t bodies = std::min(a.poses.size(), b.poses.size());
    const bool first_full = result.first_frame >= 0 && result.first_full_frame < 0 && bodies > 0;
    if (first_full) result.first_full_frame = static_cast<int>(k);
    for (std::size_t body = 1; body < bodies; ++body) {
      const BodyDifference found = difference(a.poses[body], b.poses[body]);
      result.largest_position = std::max(result.largest_position, found.position);
      result.largest_orientation = std::max(result.largest_orientation, found.orientation);
      if (first_full && found.is_larger_than(largest)) {
        largest = found;
        result.body = static_cast<int>(body);
      }
    }
  }
  result.axis = largest.axis;
  result.size = largest.size();
  if (result.first_frame < 0 && expected.frames.size() != actual.frames.size()) {
    result.first_frame = static_cast<int>(common);
  }
  return result;
}

}  // namespace substep
