#include "sim/loading/scene_expectations.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

namespace substep {
namespace {

struct QuantityTraits {
  Quantity quantity;
  const char* name;
  const char* unit;
  bool has_bodies;
  bool has_direction;
  bool can_be_relative;
  bool has_axis;  ///< `direction` and `centre` are those of an axis
};

constexpr std::array quantities{
    QuantityTraits{Quantity::displacement, "displacement", "m", true, false, false, false},
    QuantityTraits{Quantity::position, "position", "m", true, true, true, false},
    QuantityTraits{Quantity::way, "way", "m", true, true, true, false},
    QuantityTraits{Quantity::velocity, "velocity", "m/s", true, true, true, false},
    QuantityTraits{Quantity::speed, "speed", "m/s", true, false, false, false},
    QuantityTraits{Quantity::angular_velocity, "angular_velocity", "rad/s", true, true, false, false},
    QuantityTraits{Quantity::angle, "angle", "rad", true, true, false, false},
    QuantityTraits{Quantity::azimuth, "azimuth", "rad", true, true, false, true},
    QuantityTraits{Quantity::distance, "distance", "m", true, true, false, true},
    QuantityTraits{Quantity::energy_change, "energy_change", "J", false, false, false, false},
    QuantityTraits{Quantity::momentum_change, "momentum_change", "N·s", false, false, false, false},
    QuantityTraits{Quantity::angular_momentum_change, "angular_momentum_change", "N·m·s", false, false, false,
                   false},
    QuantityTraits{Quantity::joint_gap, "joint_gap", "m", false, false, false, false},
    QuantityTraits{Quantity::contact_impulse, "contact_impulse", "N·s", false, true, false, false},
    QuantityTraits{Quantity::contact_work, "contact_work", "J", false, false, false, false},
};

const QuantityTraits& traits_of(Quantity quantity) {
  return *std::ranges::find(quantities, quantity, &QuantityTraits::quantity);
}

/// "+X", "−Y" or "(0.6, 0, 0.8)".
std::string direction_text(const Vector3& direction) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::fabs(direction[axis]) == 1)
      return fmt::format("{}{}", direction[axis] > 0 ? "+" : "−", "XYZ"[axis]);
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

std::string name_of(const Expectation& e, const Scene& scene) {
  std::string what = name(e.quantity);
  std::ranges::replace(what, '_', ' ');
  std::string who;
  if (e.bodies.size() == 1) {
    who = scene.bodies[static_cast<std::size_t>(e.bodies[0])].name + ": ";
  } else if (e.bodies.size() > 1) {
    who = fmt::format("{} bodies: ", e.bodies.size());
  }
  const QuantityTraits& traits = traits_of(e.quantity);
  const bool turns = e.quantity == Quantity::angular_velocity || e.quantity == Quantity::angle;
  const std::string along =
      traits.has_direction
          ? fmt::format(" {} {}", turns || traits.has_axis ? "about" : "along", direction_text(e.direction))
          : "";
  const std::string from =
      e.relative_to == world_body
          ? ""
          : fmt::format(" from {}", scene.bodies[static_cast<std::size_t>(e.relative_to)].name);
  return who + what + along + from + reading_text(e, scene.duration);
}

class Reader {
 public:
  explicit Reader(const Scene& scene) : scene_(scene) {
    for (std::size_t i = 1; i < scene.bodies.size(); ++i)
      body_of_[scene.bodies[i].name] = static_cast<int>(i);
  }

  Expectation read(const JsonValue& json) const {
    json.allow_only({"name",   "quantity", "body",    "bodies",     "relative_to", "direction", "frame",
                     "centre", "at",       "mean",    "throughout", "peak",        "crossing",  "stays",
                     "level",  "value",    "at_most", "at_least",   "tolerance",   "source"});
    Expectation e;
    const QuantityTraits& traits = quantity_in(json.require("quantity"));
    e.quantity = traits.quantity;
    read_bodies(json, traits, e);
    read_direction(json, traits, e);
    read_value(json, e);
    read_reading(json, e);
    e.source = json.require("source").text();
    if (e.source.size() > 1000) json.require("source").fail("has more than 1000 bytes: shorten it");
    e.name = json.name(name_of(e, scene_));
    return e;
  }

 private:
  static const QuantityTraits& quantity_in(const JsonValue& json) {
    const auto found =
        std::ranges::find(quantities, std::string_view(json.text()),
                          [](const QuantityTraits& traits) { return std::string_view(traits.name); });
    if (found != quantities.end()) return *found;
    std::vector<const char*> known;
    for (const QuantityTraits& traits : quantities) known.push_back(traits.name);
    json.fail(fmt::format("'{}' is no quantity; give one of {}", json.text(), fmt::join(known, ", ")));
  }

  static void refuse(const JsonValue& json, const char* key, const QuantityTraits& traits) {
    if (const auto given = json.find(key))
      given->fail(fmt::format("has no meaning for '{}': leave it out", traits.name));
  }

  int body_in(const JsonValue& json) const {
    const auto found = body_of_.find(json.text());
    if (found != body_of_.end()) return found->second;
    std::vector<std::string> some;
    for (std::size_t i = 1; i < std::min<std::size_t>(scene_.bodies.size(), 6); ++i)
      some.push_back(scene_.bodies[i].name);
    json.fail(fmt::format("there is no body '{}'; give the name of a node with motion ({}{})", json.text(),
                          some.empty() ? "the scene has none" : fmt::format("{}", fmt::join(some, ", ")),
                          scene_.bodies.size() > 6 ? ", …" : ""));
  }

  void read_bodies(const JsonValue& json, const QuantityTraits& traits, Expectation& e) const {
    const auto one = json.find("body");
    const auto several = json.find("bodies");
    if (!traits.has_bodies) {
      for (const char* key : {"body", "bodies"}) refuse(json, key, traits);
    } else if (one && several) {
      several->fail("stands beside 'body': give one of them");
    } else if (one) {
      e.bodies.push_back(body_in(*one));
    } else if (several) {
      for (const JsonValue& item : several->items()) e.bodies.push_back(body_in(item));
      if (e.bodies.empty()) several->fail("is empty: name bodies, or leave it out for all that can move");
    } else {
      for (std::size_t i = 1; i < scene_.bodies.size(); ++i) {
        if (scene_.bodies[i].inverse_mass > 0) e.bodies.push_back(static_cast<int>(i));
      }
      if (e.bodies.empty()) json.fail("means all bodies that can move, and there is none: name a 'body'");
    }
    if (!traits.can_be_relative) return refuse(json, "relative_to", traits);
    if (const auto other = json.find("relative_to")) e.relative_to = body_in(*other);
  }

  static void read_direction(const JsonValue& json, const QuantityTraits& traits, Expectation& e) {
    if (!traits.has_axis) refuse(json, "centre", traits);
    if (!traits.has_direction) {
      for (const char* key : {"direction", "frame"}) refuse(json, key, traits);
      return;
    }
    const JsonValue direction = json.require("direction");
    e.direction = direction.vector3();
    const double length = e.direction.norm();
    if (!(length > 0) || !std::isfinite(length)) direction.fail("has no length: give the vector along which");
    e.direction /= length;
    if (const auto centre = json.find("centre")) e.centre = centre->vector3();
    const auto frame = json.find("frame");
    if (!frame) return;
    if (frame->text() != "world" && frame->text() != "node")
      frame->fail(fmt::format("'{}' is no frame; give world or node", frame->text()));
    e.in_node = frame->text() == "node";
    if (e.in_node && e.quantity != Quantity::angular_velocity)
      frame->fail(fmt::format("has meaning for 'angular_velocity' only, not for '{}'", traits.name));
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
      json.fail(fmt::format("is {:g} s, which is after the scene's end at {:g} s: raise 'duration'", time,
                            scene_.duration));
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

  static int count_in(const JsonValue& json) {
    const auto count = static_cast<int>(json.integer(1'000'000));
    if (count < 1) json.fail("must be at least 1: which time it is");
    return count;
  }

  void read_reading(const JsonValue& json, Expectation& e) const {
    e.to = std::numeric_limits<double>::infinity();
    int given = 0;
    for (const auto& [key, reading] :
         {std::pair{"at", Reading::at}, std::pair{"mean", Reading::mean}, std::pair{"peak", Reading::peak},
          std::pair{"throughout", Reading::throughout}, std::pair{"crossing", Reading::crossing},
          std::pair{"stays", Reading::stays}}) {
      const auto found = json.find(key);
      if (!found) continue;
      if (++given > 1)
        found->fail(
            "is the second of 'at', 'mean', 'throughout', 'peak', 'crossing' and 'stays': give one, or none");
      e.reading = reading;
      if (reading == Reading::at) e.from = e.to = time_in(*found);
      if (reading == Reading::mean || reading == Reading::throughout) read_interval(*found, e);
      if (reading == Reading::peak || reading == Reading::crossing) e.count = count_in(*found);
      if (reading == Reading::stays) e.level = found->number();
    }
    if (const auto level = json.find("level")) {
      if (e.reading != Reading::crossing) level->fail("has no meaning without 'crossing': leave it out");
      e.level = level->number();
    }
    const bool is_time = e.reading == Reading::crossing || e.reading == Reading::stays;
    if (is_time && e.value > scene_.duration)
      json.fail(
          fmt::format("expects a time of {:g} s, after the scene's end at {:g} s", e.value, scene_.duration));
    // In a run that is cut short a maximum may not have come yet, and no one can say which.
    if (std::isfinite(e.to)) e.needs = e.to;
    if (e.reading == Reading::peak) e.needs = scene_.duration;
    if (e.reading == Reading::crossing) e.needs = std::min(e.value + e.tolerance, scene_.duration);
  }

  const Scene& scene_;
  std::map<std::string, int, std::less<>> body_of_;
};

std::optional<JsonValue> list_in(const JsonValue& object) {
  const auto extras = object.find("extras");
  if (!extras || !extras->json().is_object()) return std::nullopt;
  const auto settings = extras->find("substep");
  return settings ? settings->find("expected") : std::nullopt;
}

}  // namespace

const char* unit_of(const Expectation& expectation) {
  const bool is_time = expectation.reading == Reading::crossing || expectation.reading == Reading::stays;
  return is_time ? "s" : traits_of(expectation.quantity).unit;
}

const char* name(Quantity quantity) {
  return traits_of(quantity).name;
}

double error_of(Bound bound, double expected, double value) {
  if (!std::isfinite(value)) return std::numeric_limits<double>::infinity();
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

void read_expectations(const GltfDocument& document, Scene& scene) {
  constexpr std::size_t most = 1000;
  constexpr std::size_t most_followed = 200'000;
  std::optional<JsonValue> list;
  if (document.scene >= 0) list = list_in(document.item_of("scenes", document.scene));
  if (!list) list = list_in(document.root());
  if (!list) return;
  const std::vector<JsonValue> items = list->items();
  if (items.size() > most) list->fail(fmt::format("has {} items; at most {} are read", items.size(), most));
  const Reader reader(scene);
  std::size_t followed = 0;  // bodies that a run follows, over all items
  for (const JsonValue& item : items) {
    scene.expected.push_back(reader.read(item));
    followed += scene.expected.back().bodies.size();
    if (followed > most_followed)
      list->fail(fmt::format("follows more than {} bodies, all items together: name fewer", most_followed));
  }
}

}  // namespace substep
