#include "golden/suite/sidecar.h"

#include <fmt/format.h>

#include <algorithm>

#include "golden/suite/scene_parts.h"
#include "sim/error.h"
#include "sim/loading/json_value.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* sidecar_format = "substep golden 1";

Json to_json(const std::vector<BodyExtent>& bodies) {
  Json json = Json::array();
  for (const BodyExtent& b : bodies) json.push_back({b.body, b.pixels, b.left, b.top, b.right, b.bottom});
  return json;
}

std::vector<BodyExtent> extents_in(const Json& json) {
  std::vector<BodyExtent> result;
  for (const Json& b : json) result.push_back({b.at(0), b.at(1), b.at(2), b.at(3), b.at(4), b.at(5)});
  return result;
}

/// Writes an item a line, but a list of numbers in one line, since a sidecar has some for every body.
void write_json(const Json& json, std::size_t depth, std::string& text) {
  const auto is_plain = [](const Json& item) { return !item.is_structured(); };
  if (is_plain(json) || json.empty() ||
      (json.is_array() && std::all_of(json.begin(), json.end(), is_plain))) {
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

void read_pictures(const Json& json, Sidecar& result) {
  for (const Json& image : json.at("images")) {
    result.pictures.push_back({image.at("frame"), image.at("pixels"), extents_in(image.at("bodies"))});
  }
}

}  // namespace

const Sidecar::Picture* Sidecar::picture(int frame) const {
  const auto found =
      std::find_if(pictures.begin(), pictures.end(), [&](const Picture& p) { return p.frame == frame; });
  return found == pictures.end() ? nullptr : &*found;
}

Sidecar read_sidecar(const fs::path& file) {
  Sidecar result;
  if (!fs::exists(file)) return result;
  result.is_there = true;
  try {
    const Json json = parse_json<Json>(read_bytes(file), file.string());
    result.scene_hash = json.at("scene_hash");
    result.made_with = json.at("made_with");
    result.platform = result.made_with.at("platform");
    result.parts = json.at("parts");
    result.pose_log_hash = json.at("poses").at("log_hash");
    result.track_hash = json.at("poses").at("track_hash");
    read_pictures(json, result);
  } catch (const Json::exception&) {
    throw Error(fmt::format(
        "{}: is damaged: put back the one that was approved, or delete it and approve the case again",
        file.string()));
  }
  return result;
}

Json to_json(const MadeWith& made_with) {
  return {{"renderer", made_with.renderer},
          {"pinned", made_with.is_pinned},
          {"platform", made_with.platform},
          {"compiler", made_with.compiler},
          {"processor", made_with.processor}};
}

Json make_sidecar(const SuiteCase& entry, const ApprovableRun& run, const Scene& scene,
                  std::span<const ApprovablePicture> pictures, const MadeWith& made_with) {
  Json images = Json::array();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const render::Image& picture = *pictures[i].picture;
    images.push_back({{"frame", entry.images[i]},
                      {"pixels", pixel_hash(picture)},
                      {"bodies", to_json(pictures[i].bodies)}});
  }
  return {{"format", sidecar_format},
          {"case", entry.name},
          {"scene", entry.scene.filename().string()},
          {"scene_hash", fmt::format("{:016x}", scene.hash)},
          {"settings", run_settings(entry)},
          {"frames", entry.frames},
          {"poses",
           {{"first", fmt::format("{:016x}", run.log->frames.front().hash)},
            {"last", fmt::format("{:016x}", run.log->frames.back().hash)},
            {"log_hash", run.pose_log_hash},
            {"track_hash", run.track_hash}}},
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

std::string provenance_differences(const Sidecar& sidecar, const MadeWith& here) {
  std::string text;
  if (!sidecar.is_there) return text;
  const Json mine = to_json(here);
  for (const char* key : {"renderer", "compiler", "processor"}) {
    // A suite without pictures has no renderer.
    const auto here_too = mine.at(key).get<std::string>();
    const std::string golden = sidecar.made_with.value(key, std::string());
    if (golden == here_too || here_too.empty()) continue;
    text += fmt::format("{}{} {}, here {}", text.empty() ? "golden made with " : "; ", key, golden, here_too);
  }
  return text;
}

std::string pixel_hash(const render::Image& image) {
  return fmt::format("{:016x}", hash(image));
}

}  // namespace substep::golden
