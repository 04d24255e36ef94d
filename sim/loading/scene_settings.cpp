#include "sim/loading/scene_settings.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sim/loading/gltf_document.h"
#include "sim/model/settings_fields.h"
#include "sim/model/usual_settings.h"

namespace substep {
namespace {

struct QuantityTraits {
  Quantity quantity;
  const char* name;
  const char* unit;
  bool has_bodies = false;
  bool has_direction = false;
  bool can_be_relative = false;
  bool has_axis = false;  ///< `direction` and `centre` are those of an axis
};

constexpr std::array quantities{
    QuantityTraits{Quantity::displacement, "displacement", "m", true},
    QuantityTraits{Quantity::position, "position", "m", true, true, true},
    QuantityTraits{Quantity::way, "way", "m", true, true, true},
    QuantityTraits{Quantity::velocity, "velocity", "m/s", true, true, true},
    QuantityTraits{Quantity::speed, "speed", "m/s", true},
    QuantityTraits{Quantity::angular_velocity, "angular_velocity", "rad/s", true, true},
    QuantityTraits{Quantity::angle, "angle", "rad", true, true},
    QuantityTraits{Quantity::azimuth, "azimuth", "rad", true, true, false, true},
    QuantityTraits{Quantity::distance, "distance", "m", true, true, false, true},
    QuantityTraits{Quantity::energy_change, "energy_change", "J"},
    QuantityTraits{Quantity::momentum_change, "momentum_change", "N·s"},
    QuantityTraits{Quantity::angular_momentum_change, "angular_momentum_change", "N·m·s"},
    QuantityTraits{Quantity::joint_gap, "joint_gap", "m"},
    QuantityTraits{Quantity::contact_impulse, "contact_impulse", "N·s", false, true},
    QuantityTraits{Quantity::contact_work, "contact_work", "J"},
};

const QuantityTraits& traits_of(Quantity quantity) {
  return *std::ranges::find(quantities, quantity, &QuantityTraits::quantity);
}

/// True where the expected value is a time.
bool is_time(Reading reading) {
  return reading == Reading::crossing || reading == Reading::stays;
}

/// "+X", "−Y" or "(0.6, 0, 0.8)".
std::string direction_text(const Vector3& direction) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::fabs(direction[axis]) == 1) {
      return fmt::format("{}{}", direction[axis] > 0 ? "+" : "−", "XYZ"[axis]);
    }
  }
  return fmt::format("({:.3g}, {:.3g}, {:.3g})", direction.x(), direction.y(), direction.z());
}

std::string reading_text(const Expectation& e, double duration) {
  switch (e.reading) {
    case Reading::at:
      return fmt::format(" at {:.4g} s", e.from);
    case Reading::mean:
      return fmt::format(", mean from {:.4g} to {:.4g} s", e.from, e.to);
    case Reading::peak:
      return fmt::format(", maximum {}", e.count);
    case Reading::crossing:
      return fmt::format(" goes through {:.4g}, time {}", e.level, e.count);
    case Reading::stays:
      return fmt::format(" stays on its side of {:.4g}", e.level);
    case Reading::throughout:
      break;
  }
  return e.from > 0 || e.to < duration ? fmt::format(" from {:.4g} to {:.4g} s", e.from, e.to) : "";
}

/// "ball_4: velocity along +Y at 2 s".
std::string name_of(const Expectation& e, const Scene& scene) {
  const QuantityTraits& traits = traits_of(e.quantity);
  std::string text = traits.name;
  std::ranges::replace(text, '_', ' ');
  if (e.bodies.size() == 1) text = fmt::format("{}: {}", scene.bodies[e.bodies[0]].name, text);
  if (e.bodies.size() > 1) text = fmt::format("{} bodies: {}", e.bodies.size(), text);
  if (traits.has_direction) {
    const bool turns = e.quantity == Quantity::angular_velocity || e.quantity == Quantity::angle;
    text += fmt::format(" {} {}", turns || traits.has_axis ? "about" : "along", direction_text(e.direction));
  }
  if (e.relative_to != world_body) text += " from " + scene.bodies[e.relative_to].name;
  return text + reading_text(e, scene.duration);
}

class ExpectationReader {
 public:
  explicit ExpectationReader(const Scene& scene) : scene_(scene) {
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      body_of_[scene.bodies[i].name] = static_cast<int>(i);
    }
    for (const QuantityTraits& traits : quantities) named_.emplace_back(traits.name, &traits);
  }

  Expectation read(const JsonValue& json) const {
    json.allow_only({"name",   "quantity", "body",    "bodies",     "relative_to", "direction", "frame",
                     "centre", "at",       "mean",    "throughout", "peak",        "crossing",  "stays",
                     "level",  "value",    "at_most", "at_least",   "tolerance",   "source"});
    Expectation e;
    const QuantityTraits& traits = *json.require("quantity").one_of(named_);
    e.quantity = traits.quantity;
    const auto refuse = [&](bool has_meaning, const char* key) {
      if (const auto given = has_meaning ? std::nullopt : json.find(key)) {
        given->fail("has no meaning for '{}': leave it out", traits.name);
      }
    };
    for (const char* key : {"body", "bodies"}) refuse(traits.has_bodies, key);
    refuse(traits.can_be_relative, "relative_to");
    for (const char* key : {"direction", "frame"}) refuse(traits.has_direction, key);
    refuse(traits.has_axis, "centre");
    if (traits.has_bodies) read_bodies(json, e);
    if (traits.has_direction) read_direction(json, traits, e);
    read_value(json, e);
    read_reading(json, e);
    e.source = json.require("source").text();
    if (e.source.size() > 1000) json.require("source").fail("has more than 1000 bytes: shorten it");
    e.name = json.name(name_of(e, scene_));
    return e;
  }

 private:
  int body_in(const JsonValue& json) const {
    const auto found = body_of_.find(json.text());
    if (found != body_of_.end()) return found->second;
    std::string some;
    for (std::size_t i = 1; i < std::min<std::size_t>(scene_.bodies.size(), 6); ++i) {
      some += (i > 1 ? ", " : "") + scene_.bodies[i].name;
    }
    if (some.empty()) some = "the scene has none";
    json.fail("there is no body '{}'; give the name of a node with motion ({}{})", json.text(), some,
              scene_.bodies.size() > 6 ? ", …" : "");
  }

  void read_bodies(const JsonValue& json, Expectation& e) const {
    const auto one = json.find("body");
    const auto several = json.find("bodies");
    if (one && several) several->fail("stands beside 'body': give one of them");
    if (one) e.bodies.push_back(body_in(*one));
    for (const JsonValue& item : json.items("bodies")) e.bodies.push_back(body_in(item));
    if (several && e.bodies.empty()) {
      several->fail("is empty: name bodies, or leave it out for all that can move");
    }
    for (std::size_t i = 1; i < scene_.bodies.size() && !one && !several; ++i) {
      if (scene_.bodies[i].inverse_mass > 0) e.bodies.push_back(static_cast<int>(i));
    }
    if (e.bodies.empty()) json.fail("means all bodies that can move, and there is none: name a 'body'");
    if (const auto other = json.find("relative_to")) e.relative_to = body_in(*other);
  }

  static void read_direction(const JsonValue& json, const QuantityTraits& traits, Expectation& e) {
    const JsonValue direction = json.require("direction");
    e.direction = direction.vector3();
    const double length = e.direction.norm();
    if (!(length > 0) || !std::isfinite(length)) direction.fail("has no length: give the vector along which");
    e.direction /= length;
    json.read("centre", e.centre, &JsonValue::vector3);
    const auto frame = json.find("frame");
    if (!frame) return;
    e.in_node = frame->one_of<bool>({{"world", false}, {"node", true}});
    if (e.in_node && e.quantity != Quantity::angular_velocity) {
      frame->fail("has meaning for 'angular_velocity' only, not for '{}'", traits.name);
    }
  }

  static void read_value(const JsonValue& json, Expectation& e) {
    int given = 0;
    for (const auto& [key, bound] : {std::pair{"value", Bound::equal}, std::pair{"at_most", Bound::at_most},
                                     std::pair{"at_least", Bound::at_least}}) {
      const auto value = json.find(key);
      if (!value) continue;
      e.bound = bound;
      e.value = value->number();
      ++given;
    }
    if (given != 1) json.fail("needs one of 'value', 'at_most' and 'at_least'");
    e.tolerance = json.require("tolerance").positive();
  }

  double time_in(const JsonValue& json) const {
    const double time = json.non_negative();
    if (time > scene_.duration) {
      json.fail("is {:g} s, which is after the scene's end at {:g} s: raise 'duration'", time,
                scene_.duration);
    }
    return time;
  }

  void read_interval(const JsonValue& json, Expectation& e) const {
    const std::vector<JsonValue> ends = json.items();
    if (ends.size() != 2) json.fail("must be an array of 2 times in s");
    e.from = time_in(ends[0]);
    e.to = time_in(ends[1]);
    if (!(e.from < e.to)) json.fail("must begin before it ends");
  }

  void read_reading(const JsonValue& json, Expectation& e) const {
    e.to = infinity;
    int given = 0;
    for (const auto& [key, reading] :
         {std::pair{"at", Reading::at}, std::pair{"mean", Reading::mean}, std::pair{"peak", Reading::peak},
          std::pair{"throughout", Reading::throughout}, std::pair{"crossing", Reading::crossing},
          std::pair{"stays", Reading::stays}}) {
      const auto found = json.find(key);
      if (!found) continue;
      if (++given > 1) {
        found->fail(
            "is the second of 'at', 'mean', 'throughout', 'peak', 'crossing' and 'stays': give one, or none");
      }
      e.reading = reading;
      if (reading == Reading::at) e.from = e.to = time_in(*found);
      if (reading == Reading::mean || reading == Reading::throughout) read_interval(*found, e);
      if (reading == Reading::peak || reading == Reading::crossing) {
        e.count = static_cast<int>(found->integer(1'000'000));
        if (e.count < 1) found->fail("must be at least 1: which time it is");
      }
      if (reading == Reading::stays) e.level = found->number();
    }
    if (const auto level = json.find("level")) {
      if (e.reading != Reading::crossing) level->fail("has no meaning without 'crossing': leave it out");
      e.level = level->number();
    }
    if (is_time(e.reading) && e.value > scene_.duration) {
      json.fail("expects a time of {:g} s, after the scene's end at {:g} s", e.value, scene_.duration);
    }
    // In a run that is cut short a maximum may not have come yet, and no one can say which.
    if (std::isfinite(e.to)) e.needs = e.to;
    if (e.reading == Reading::peak) e.needs = scene_.duration;
    if (is_time(e.reading)) e.needs = std::min(e.value + e.tolerance, scene_.duration);
  }

  const Scene& scene_;
  std::map<std::string, int, std::less<>> body_of_;
  std::vector<std::pair<const char*, const QuantityTraits*>> named_;
};

/// Returns `extras.substep` of the document, then that of its default scene.
std::vector<JsonValue> settings_in(const GltfDocument& document) {
  std::vector<JsonValue> result;
  if (const auto settings = document.root().settings()) result.push_back(*settings);
  if (document.scene < 0) return result;
  if (const auto settings = document.item_of("scenes", document.scene).settings())
    result.push_back(*settings);
  return result;
}

double substeps_for_masses(const Scene& scene) {
  return std::ceil(std::sqrt(2 * mass_ratio(scene)));
}

/// Returns the number of sub-steps above which A5 with 'stable' joints gets worse (claim 6 of the report):
/// 100 for a chain of rods, 40 in loops, 20 in loops that springs close.
int most_substeps_of_a5(const Scene& scene) {
  if (has_loop(scene, Springs::skip)) return substeps_in_loop;
  return has_loop(scene, Springs::count) ? 20 : most_default_substeps;
}

}  // namespace

const char* unit_of(const Expectation& expectation) {
  return is_time(expectation.reading) ? "s" : traits_of(expectation.quantity).unit;
}

const char* name(Quantity quantity) {
  return traits_of(quantity).name;
}

double error_of(Bound bound, double expected, double value) {
  if (!std::isfinite(value)) return infinity;
  switch (bound) {
    case Bound::at_most:
      return std::max(0.0, value - expected);
    case Bound::at_least:
      return std::max(0.0, expected - value);
    case Bound::equal:
      break;
  }
  return std::fabs(value - expected);
}

void read_settings(const GltfDocument& document, Scene& scene) {
  for (const JsonValue& settings : settings_in(document)) {
    settings.allow_only({"gravity", "duration", "step", "substeps", "poster", "gyroscopic", "expected"});
    settings.read("gravity", scene.gravity, &JsonValue::vector3);
    const auto gravity = settings.find("gravity");
    if (gravity && std::abs(scene.gravity.z()) > 0.99 * scene.gravity.norm()) {
      gravity->warn(
          "is along z, but +Y is up in glTF and in pictures: turn a scene whose +Z is up by a node above all "
          "others with the rotation [-0.7071068, 0, 0, 0.7071068]");
    }
    settings.read("duration", scene.duration, &JsonValue::positive);
    settings.read("step", scene.step, &JsonValue::positive);
    settings.read("poster", scene.poster, &JsonValue::non_negative);
    settings.read("gyroscopic", scene.gyroscopic, &JsonValue::boolean);
  }
}

void read_expectations(const GltfDocument& document, Scene& scene) {
  constexpr std::size_t most = 1000;
  constexpr std::size_t most_followed = 200'000;
  std::optional<JsonValue> list;
  for (const JsonValue& settings : settings_in(document)) {
    if (const auto given = settings.find("expected")) list = given;
  }
  if (!list) return;
  const std::vector<JsonValue> items = list->items();
  if (items.size() > most) list->fail("has {} items; at most {} are read", items.size(), most);
  const ExpectationReader reader(scene);
  std::size_t followed = 0;  // bodies that a run follows, over all items
  for (const JsonValue& item : items) {
    scene.expected.push_back(reader.read(item));
    followed += scene.expected.back().bodies.size();
    if (followed > most_followed) {
      list->fail("follows more than {} bodies, all items together: name fewer", most_followed);
    }
  }
}

void read_substeps(const GltfDocument& document, Scene& scene) {
  scene.substeps = needed_substeps(scene);
  for (const JsonValue& settings : settings_in(document)) {
    const auto substeps = settings.find("substeps");
    if (!substeps) continue;
    scene.substeps =
        static_cast<int>(substeps->integer(static_cast<std::uint64_t>(field_named("substeps").range.high)));
    if (scene.substeps < 1) substeps->fail("must be 1 or more");
  }
}

int needed_substeps(const Scene& scene) {
  const double enough =
      has_loop(scene, Springs::skip) ? substeps_in_loop : default_settings(Algorithm::a5).substeps;
  return static_cast<int>(std::clamp<double>(substeps_for_masses(scene), enough, most_default_substeps));
}

std::string doubt_about_substeps(const Scene& scene, const Settings& settings) {
  if (settings.algorithm == Algorithm::a1 || !is_of_report(settings.algorithm)) return "";
  const int given = settings.algorithm == Algorithm::a2 ? settings.iterations : settings.substeps;
  const double asked = substeps_for_masses(scene);
  if (asked > most_default_substeps && given < asked) {
    return fmt::format(
        "its heaviest body is {:.3g} times as heavy as its lightest, which asks for {:.0f} sub-steps, and "
        "not "
        "{}: light bodies give way under heavy ones",
        mass_ratio(scene), asked, given);
  }
  const int most = most_substeps_of_a5(scene);
  if (settings.algorithm == Algorithm::a5 && settings.joints == Joints::stable && !scene.joints.empty() &&
      given > most) {
    return fmt::format("A5 gets worse with more than {} sub-steps where there are {}", most,
                       most == most_default_substeps ? "joints" : "loops of joints");
  }
  return "";
}

}  // namespace substep
