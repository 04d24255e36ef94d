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

constexpr std::string_view log_name = "substep pose log";
constexpr std::string_view first_line = "substep pose log 1";
constexpr std::string_view units_line = "units metres seconds radians";

/// Returns the text with control characters and backslashes as \x and two hexadecimal digits.
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

/// Returns at most 60 bytes, escaped, for a message: a binary file can have lines of megabytes.
std::string shortened(std::string_view text) {
  return escaped(text.substr(0, 60)) + (text.size() > 60 ? "…" : "");
}

/// Returns the number if the whole text is one finite number.
template <typename Number, typename... Base>
std::optional<Number> number_in(std::string_view text, Base... base) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base...);
  const bool is_whole = error == std::errc{} && end == text.data() + text.size();
  return is_whole && std::isfinite(static_cast<double>(value)) ? std::optional(value) : std::nullopt;
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

/// Reads a log line by line. Throws Error with the line's number where a line is not as expected.
class PoseLogReader {
 public:
  PoseLogReader(std::string_view text, const std::string& what) : rest_(text), what_(what) {}

  bool at_end() const { return rest_.empty(); }

  /// Reads the next line; the message names `expected` if there is none.
  void next(std::string_view expected) {
    if (rest_.empty()) {
      ++line_number_;
      refuse("the log ends where '{}' is expected: it is truncated", expected);
    }
    const std::size_t length = rest_.find('\n');
    ++line_number_;
    if (length == std::string_view::npos) refuse("the line has no end: the log is truncated");
    line_ = rest_.substr(0, length);
    rest_.remove_prefix(length + 1);
  }

  bool starts_with(std::string_view key) const {
    return line_.substr(0, key.size()) == key && line_.substr(key.size(), 1) == " ";
  }

  std::string_view line() const { return line_; }

  /// Returns the text after `key` and a space in the current line. Throws Error without them.
  std::string_view after(std::string_view key) const {
    if (!starts_with(key)) refuse("'{} …' is expected, not '{}'", key, shortened(line_));
    return line_.substr(key.size() + 1);
  }

  /// Reads the next line and returns the text after `key` in it.
  std::string_view value(std::string_view key) {
    next(key);
    return after(key);
  }

  bool is_next(std::string_view key) const { return rest_.starts_with(key); }

  template <typename Number, typename... Base>
  Number number(std::string_view text, std::string_view of, Base... base) const {
    const auto value = number_in<Number>(text, base...);
    if (!value) refuse("'{}' is not a number that {} can be", shortened(text), of);
    return *value;
  }

  std::string name(std::string_view text) const {
    auto result = unescaped(text);
    if (!result) refuse("a backslash must be followed by x and two hexadecimal digits");
    return *std::move(result);
  }

  std::uint64_t hash(std::string_view text) const {
    if (text.size() != 16) refuse("'{}' is not a hash of 16 hexadecimal digits", shortened(text));
    return number<std::uint64_t>(text, "a hash", 16);
  }

  /// Returns the words of `text`, which must be `count`, separated by single spaces.
  template <std::size_t count>
  std::array<std::string_view, count> words(std::string_view text) const {
    std::array<std::string_view, count> result;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t length = i + 1 < count ? text.find(' ') : text.size();
      if (length == std::string_view::npos || text.substr(0, length).empty()) {
        refuse("{} items are expected, not '{}'", count, shortened(line_));
      }
      result[i] = text.substr(0, length);
      text.remove_prefix(std::min(text.size(), length + 1));
    }
    return result;
  }

  template <typename... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> text, Args&&... args) const {
    throw Error("{}:{}: {}", what_, line_number_, fmt::format(text, std::forward<Args>(args)...));
  }

 private:
  std::string_view rest_;
  std::string what_;
  std::string_view line_;
  int line_number_ = 0;
};

void read_header(PoseLogReader& reader, PoseLog& log) {
  reader.next(first_line);
  if (reader.line() != first_line) {
    if (reader.starts_with(log_name)) {
      if (reader.line().ends_with('\r'))
        reader.refuse("the line ends in CR LF: convert the log to LF, or turn off git's core.autocrlf");
      reader.refuse("version {} of the pose log is unknown here: this program reads version 1",
                    escaped(reader.after(log_name).substr(0, 20)));
    }
    reader.refuse("this is no pose log: its first line would be '{}'", first_line);
  }
  reader.next(units_line);
  if (reader.line() != units_line) reader.refuse("'{}' is expected", units_line);
  log.scene = reader.name(reader.value("scene"));
  log.scene_hash = reader.hash(reader.value("scene-hash"));
  if (reader.is_next("author ")) log.author = reader.name(reader.value("author"));
  for (const SettingsField& field : settings_fields) {
    if (!log.has_setting(field.name)) continue;
    // Accept logs that are older than the field, which then keeps its value in Settings{}.
    const bool is_optional = field.can_be_left_out || !field.overrides.empty();
    if (is_optional && !reader.is_next(field.name)) continue;
    const std::string_view text = reader.value(field.name);
    if (set(log.settings, field, text)) continue;
    reader.refuse("{} '{}': must be {}", field.name, shortened(text), kind_of(field));
  }
  try {
    check(log.settings);
  } catch (const Error& error) {
    reader.refuse("{}", error.what());
  }
  log.modelled = reader.name(reader.value("modelled"));

  log.bodies = {"world"};
  for (reader.next("body"); reader.starts_with("body"); reader.next("full-every")) {
    const std::string_view text = reader.after("body");
    const std::size_t space = std::min(text.find(' '), text.size());
    const int index = reader.number<int>(text.substr(0, space), "a body's index");
    if (index != static_cast<int>(log.bodies.size())) {
      reader.refuse("body {} is expected here, not {}", log.bodies.size(), index);
    }
    log.bodies.push_back(reader.name(text.substr(std::min(text.size(), space + 1))));
  }
  log.full_every = reader.number<int>(reader.after("full-every"), "full-every");
  if (log.full_every < 1) reader.refuse("full-every must be at least 1");
}

/// Reads the poses after a frame's line, and the first line that is no pose.
void read_poses(PoseLogReader& reader, PoseLog& log) {
  PoseLog::Frame& frame = log.frames.back();
  for (reader.next("end"); reader.starts_with("pose"); reader.next("end")) {
    const auto words = reader.words<8>(reader.after("pose"));
    if (frame.poses.empty()) frame.poses.emplace_back();
    const int body = reader.number<int>(words[0], "a body's index");
    if (frame.poses.size() >= log.bodies.size()) {
      reader.refuse("a pose too many: there are {} bodies", log.bodies.size() - 1);
    }
    if (body != static_cast<int>(frame.poses.size())) {
      reader.refuse("the pose of body {} is expected here, not of {}", frame.poses.size(), body);
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
    reader.refuse("the pose of body {} is missing", frame.poses.size());
  }
}

void read_frames(PoseLogReader& reader, PoseLog& log) {
  reader.next("frame");
  while (reader.starts_with("frame")) {
    const auto words = reader.words<2>(reader.after("frame"));
    const int number = reader.number<int>(words[0], "a frame");
    if (number != static_cast<int>(log.frames.size())) {
      reader.refuse("frame {} is expected here, not {}", log.frames.size(), number);
    }
    log.frames.push_back({reader.hash(words[1]), {}});
    read_poses(reader, log);
    const bool last = !reader.starts_with("frame");
    const bool must_be_full = log.bodies.size() > 1 && (number % log.full_every == 0 || last);
    if (must_be_full == log.frames.back().poses.empty()) {
      reader.refuse("frame {} {} poses", number, must_be_full ? "must have" : "must have no");
    }
  }
  if (log.frames.empty()) reader.refuse("'frame 0 …' is expected");
}

void read_end(PoseLogReader& reader, PoseLog& log) {
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
    reader.refuse("an end that fits frame {} as the last is expected, as 'end ok {}'", last, last);
  }
  if (!reader.at_end()) {
    reader.next("");
    reader.refuse("nothing may follow the line 'end'");
  }
}

std::string header_text(const PoseLog& log) {
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out, "{}\n{}\n", first_line, units_line);
  fmt::format_to(out, "scene {}\nscene-hash {:016x}\n", escaped(log.scene), log.scene_hash);
  if (!log.author.empty()) fmt::format_to(out, "author {}\n", escaped(log.author));
  for (const SettingsField& field : settings_fields) {
    if (!log.has_setting(field.name) || field.is_left_out(log.settings)) continue;
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

/// Runs the steps. Passes each frame to `take` only after the next step, since the last frame must be full.
/// Returns "ok" or how the run failed.
std::string run(Simulation& simulation, int frames, int full_every, const AfterFrame& after_frame,
                const std::function<void(PoseLog::Frame)>& take) {
  if (full_every < 1) throw Error("full poses every {} frames: must be at least 1", full_every);
  const auto frame_of = [&](bool full) {
    return PoseLog::Frame{hash(simulation.state()), full ? simulation.state().q : std::vector<Coordinates>{}};
  };
  PoseLog::Frame latest = frame_of(true);
  int first_unsolved = 0;
  int unsolved = 0;
  for (int k = 1; k <= frames; ++k) {
    const StepReport& report = simulation.step();
    if (report.status == StepReport::Status::diverged) {
      latest.poses = simulation.state().q;  // a diverged step leaves the state as it was
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

}  // namespace

PoseLog parse_pose_log(std::string_view text, const std::string& what) {
  const DefaultFloatingPoint environment;
  PoseLog log;
  PoseLogReader reader(text, what);
  read_header(reader, log);
  read_frames(reader, log);
  read_end(reader, log);
  return log;
}

PoseLog read_pose_log(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code failure;
  if (!std::filesystem::exists(file, failure) && !failure) throw Error(name + ": there is no such file");
  if (std::filesystem::is_directory(file, failure)) throw Error(name + ": is a folder, not a pose log");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(name + ": cannot be read");
  // Read the first bytes alone, since the file may be an endless device.
  std::string text(60, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > log_name.size() && !text.starts_with(log_name)) return parse_pose_log(text + '\n', name);
  if (stream) text.append(std::istreambuf_iterator<char>(stream), {});
  if (stream.bad()) throw Error(name + ": cannot be read to its end");
  return parse_pose_log(text, name);
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

}  // namespace substep
