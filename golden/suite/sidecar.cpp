#include "golden/suite/sidecar.h"

#include <fmt/format.h>

#include <algorithm>

#include "sim/error.h"
#include "sim/measure/json.h"
#include "sim/model/settings_fields.h"

namespace substep::golden {
namespace {

/// Writes one item a line, but a list of numbers in one line, since a sidecar has such lists for every body.
void write_json(const Json& json, std::size_t depth, std::string& text) {
  const auto is_plain = [](const Json& item) { return !item.is_structured(); };
  if (is_plain(json) || json.empty() || (json.is_array() && std::ranges::all_of(json, is_plain))) {
    text += json.dump();
    return;
  }
  text += json.is_array() ? "[" : "{";
  bool is_first = true;
  for (const auto& [key, item] : json.items()) {
    text += fmt::format("{}\n{:{}}", is_first ? "" : ",", "", depth + 1);
    if (json.is_object()) text += fmt::format("{}: ", Json(key).dump());
    write_json(item, depth + 1, text);
    is_first = false;
  }
  text += fmt::format("\n{:{}}{}", "", depth, json.is_array() ? "]" : "}");
}

Sidecar::Picture picture_in(const Json& json) {
  Sidecar::Picture picture{json.at("frame"), json.at("pixels"), {}};
  for (const Json& b : json.at("bodies"))
    picture.bodies.push_back({b.at(0), b.at(1), b.at(2), b.at(3), b.at(4), b.at(5)});
  return picture;
}

/// Returns the values of keys that both have and that differ: "substeps 10, here 20; frames 60, here 90".
std::string differences(const Json& golden, const Json& here) {
  std::string text;
  const auto shown = [](const Json& value) {
    return value.is_string() ? value.get<std::string>() : value.dump();
  };
  for (const auto& [key, value] : golden.items()) {
    // Skip the renderer of a suite without pictures.
    if (!here.contains(key) || here.at(key) == value || here.at(key) == "") continue;
    text += fmt::format("{}{} {}, here {}", text.empty() ? "" : "; ", key, shown(value), shown(here.at(key)));
  }
  return text;
}

}  // namespace

const Sidecar::Picture* Sidecar::picture(int frame) const {
  const auto found = std::ranges::find(pictures, frame, &Picture::frame);
  return found == pictures.end() ? nullptr : &*found;
}

Sidecar read_sidecar(const std::filesystem::path& file) {
  Sidecar result;
  if (!std::filesystem::exists(file)) return result;
  result.is_there = true;
  try {
    const Json json = parse_json(read_bytes(file), file.string());
    result.scene_hash = json.at("scene_hash");
    result.run = json.value("settings", Json::object());
    for (const char* key : {"frames", "size"})
      if (json.contains(key)) result.run[key] = json.at(key);
    result.made_with = json.at("made_with");
    result.platform = result.made_with.at("platform");
    result.parts = json.at("parts");
    result.pose_log_hash = json.at("poses").at("log_hash");
    result.track_hash = json.at("poses").at("track_hash");
    for (const Json& image : json.at("images")) result.pictures.push_back(picture_in(image));
  } catch (const Json::exception&) {
    throw Error("{}: is damaged", file.string());
  }
  return result;
}

Json to_json(const MadeWith& made_with) {
  return {{"substep", made_with.version},   {"renderer", made_with.renderer},
          {"pinned", made_with.is_pinned},  {"platform", made_with.platform},
          {"compiler", made_with.compiler}, {"processor", made_with.processor}};
}

Json make_sidecar(const SuiteCase& entry, const PoseLog& log, const std::string& track_hash,
                  const Scene& scene, const std::vector<Sidecar::Picture>& pictures,
                  const MadeWith& made_with) {
  Json images = Json::array();
  for (const Sidecar::Picture& picture : pictures) {
    Json bodies = Json::array();
    for (const BodyExtent& b : picture.bodies)
      bodies.push_back({b.body, b.pixels, b.left, b.top, b.right, b.bottom});
    images.push_back({{"frame", picture.frame}, {"pixels", picture.pixels}, {"bodies", bodies}});
  }
  return {{"format", "substep golden 1"},
          {"case", entry.name},
          {"scene", entry.scene.filename().string()},
          {"scene_hash", hash_text(scene.hash)},
          {"settings", run_settings(entry)},
          {"frames", entry.frames},
          {"poses",
           {{"first", hash_text(log.frames.front().hash)},
            {"last", hash_text(log.frames.back().hash)},
            {"log_hash", content_hash(to_text(log))},
            {"track_hash", track_hash}}},
          {"parts", scene_parts(scene)},
          {"size", {entry.width, entry.height}},
          {"images", images},
          {"made_with", to_json(made_with)}};
}

Json run_settings(const SuiteCase& entry) {
  if (entry.author.empty()) return to_json(entry.settings);
  Json json{{"algorithm", entry.author}, {"step", entry.settings.step}};
  if (entry.command.empty()) return json;
  json["iterations"] = entry.settings.iterations;
  json["substeps"] = entry.settings.substeps;
  return json;
}

std::string sidecar_text(const Json& sidecar) {
  std::string text;
  write_json(sidecar, 0, text);
  return text + "\n";
}

std::string settings_differences(const Sidecar& sidecar, const SuiteCase& entry) {
  if (!sidecar.is_there) return {};
  Json golden = sidecar.run;
  Json here = run_settings(entry);
  here["frames"] = entry.frames;
  here["size"] = {entry.width, entry.height};
  for (const SettingsField& field : settings_fields) {
    const std::string key(field.name);
    if (!field.can_be_left_out || golden.contains(key) == here.contains(key)) continue;
    (golden.contains(key) ? here : golden)[key] = text_of(Settings{}, field);
  }
  return differences(golden, here);
}

std::string provenance_differences(const Sidecar& sidecar, const MadeWith& here) {
  // Older sidecars lack the version.
  return differences(sidecar.made_with, {{"substep", here.version},
                                         {"renderer", here.renderer},
                                         {"compiler", here.compiler},
                                         {"processor", here.processor}});
}

}  // namespace substep::golden
