#include "golden/check/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>

#include "golden/check/motion_page.h"
#include "golden/compare/motion_comparison.h"
#include "golden/compare/track.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

struct Shown {
  int frame;
  State state;
  StepReport report;
};

class Replay {
 public:
  Replay(const SuiteCase& entry, const ReplayOptions& options)
      : options_(options), scene_(load_scene(entry.scene)), settings_(entry.settings_for(scene_)) {
    last_ = options.to < 0 ? entry.frames : options.to;
    if (last_ > entry.frames) {
      throw Error(fmt::format("--to {}: the last frame of {} is {}", last_, entry.name, entry.frames));
    }
    if (std::filesystem::exists(entry.pose_file)) golden_ = read_pose_log(entry.pose_file);
    if (std::filesystem::exists(entry.track_file)) golden_track_ = read_track(entry.track_file);
    if (!options.focus.empty()) body_ = body_named(options.focus);
  }

  std::string text() {
    run();
    if (body_ == 0) body_ = most_different();
    std::string result = fmt::format("{}: {}\n{}\n\n", scene_.name, live_.modelled, label(settings_));
    result += fmt::format("body {} {}\n", body_, scene_.bodies[body_].name);
    for (const Shown& shown : shown_) result += describe(shown);
    if (live_.end != "ok") result += fmt::format("the run ends: {}\n", live_.end);
    return result + others();
  }

  std::string page() {
    if (!golden_track_) throw Error(fmt::format("{}: has no golden track to play beside it", scene_.name));
    run();
    std::vector<std::vector<Coordinates>> live;
    for (const PoseLog::Frame& frame : live_.frames) live.push_back(frame.poses);
    return motion_page(scene_, settings_, live, *golden_track_, last_);
  }

 private:
  std::size_t body_named(const std::string& name) const {
    for (std::size_t i = 1; i < scene_.bodies.size(); ++i) {
      if (scene_.bodies[i].name == name) return i;
    }
    std::string known;
    for (std::size_t i = 1; i < scene_.bodies.size(); ++i) known += fmt::format(" {}", scene_.bodies[i].name);
    throw Error(fmt::format("--focus '{}': the scene has no such body; it has{}", name, known));
  }

  void run() {
    Simulation simulation(scene_, settings_);
    Tracker tracker(scene_, settings_);
    tracker.add(simulation.state());
    const auto keep = [&](int frame, const StepReport& report) {
      if (frame >= last_ - options_.before) shown_.push_back({frame, simulation.state(), report});
    };
    keep(0, StepReport{});
    live_ = record(simulation, last_, 1, [&](int frame, const StepReport& report) {
      tracker.add(simulation.state());
      keep(frame, report);
    });
    live_track_ = tracker.take();
  }

  PosePair pair_at(int frame) const {
    if (!golden_) return {};
    return poses_at({&*golden_, golden_track_ ? &*golden_track_ : nullptr}, {&live_, &live_track_}, frame);
  }

  static double apart(const PosePair& pair, std::size_t body) {
    if (body >= pair.golden.size() || body >= pair.actual.size()) return -1;
    return (pair.golden[body].linear - pair.actual[body].linear).norm();
  }

  std::size_t most_different() const {
    std::size_t result = 1;
    const PosePair pair = pair_at(last_);
    for (std::size_t i = 1; i < scene_.bodies.size(); ++i) {
      if (apart(pair, i) > apart(pair, result)) result = i;
    }
    return result;
  }

  std::string describe(const Shown& shown) const {
    const Coordinates& q = shown.state.q[body_];
    const Velocity& v = shown.state.v[body_];
    const auto row = [](const char* what, const Vector3& a, const char* unit) {
      return fmt::format("  {:<17} {:>22} {:>22} {:>22}  {}\n", what, a.x(), a.y(), a.z(), unit);
    };
    const auto frame = static_cast<std::size_t>(shown.frame);
    std::string text = fmt::format("frame {} ({:.4f} s)", shown.frame, shown.frame * settings_.step);
    if (golden_ && frame < golden_->frames.size()) {
      const bool same = golden_->frames[frame].hash == live_.frames[frame].hash;
      text += same ? "  state as golden" : "  state differs from golden";
    }
    text += '\n';
    text += row("position", q.linear, "m");
    text += fmt::format("  {:<17} {:>22} {:>22} {:>22} {:>22}  w x y z\n", "orientation", q.angular.w(),
                        q.angular.x(), q.angular.y(), q.angular.z());
    text += row("velocity", v.linear, "m/s") + row("angular velocity", v.angular, "rad/s");
    const PosePair pair = pair_at(shown.frame);
    if (body_ < pair.golden.size()) {
      text += row("from golden", pair.actual[body_].linear - pair.golden[body_].linear,
                  pair.is_rounded ? "m (poses kept to 1e-5)" : "m");
    }
    const Invariants& kept = live_track_.frames[frame].invariants;
    return text + fmt::format(
                      "  step: {} contact points, {} rows, {} row solves; energy {:.6g} J, "
                      "penetration {:.3g} m\n",
                      shown.report.contacts, shown.report.rows, shown.report.row_solves, kept.energy,
                      kept.penetration);
  }

  std::string others() const {
    const PosePair pair = pair_at(last_);
    std::string text;
    for (std::size_t i = 1; i < scene_.bodies.size(); ++i) {
      if (!(apart(pair, i) > 0)) continue;
      text += fmt::format("  {:<24} {:.3g} m\n", scene_.bodies[i].name, apart(pair, i));
    }
    return text.empty() ? text : fmt::format("\nbodies off the golden run at frame {}:\n{}", last_, text);
  }

  ReplayOptions options_;
  Scene scene_;
  Settings settings_;
  int last_ = 0;
  std::size_t body_ = 0;
  std::optional<PoseLog> golden_;
  std::optional<Track> golden_track_;
  PoseLog live_;
  Track live_track_;
  std::vector<Shown> shown_;
};

}  // namespace

std::string replay(const SuiteCase& entry, const ReplayOptions& options) {
  return Replay(entry, options).text();
}

std::string replay_page(const SuiteCase& entry, const ReplayOptions& options) {
  return Replay(entry, options).page();
}

}  // namespace substep
