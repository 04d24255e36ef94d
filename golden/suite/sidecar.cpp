#include "golden/suite/sidecar.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/error.h"
#include "sim/loading/parse_json.h"

namespace substep {
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

void read_pictures(const Json& json, const fs::path& folder, Sidecar& result) {
  for (const Json& image : json.at("images")) {
    Sidecar::Picture picture{image.at("frame"), image.at("pixels"), {}};
    if (image.contains("bodies")) picture.bodies = extents_in(image.at("bodies"));
    result.pictures.push_back(std::move(picture));
  }
  if (!json.contains("alternates")) return;
  for (const Json& entry : json.at("alternates")) {
    result.alternates.push_back({entry.at("frame"), folder / entry.at("file").get<std::string>(),
                                 entry.at("pixels"), entry.at("reason")});
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
  try {
    const Json json = parse_json<Json>(read_bytes(file), file.string());
    result.scene_hash = json.at("scene_hash");
    result.made_with = json.at("made_with");
    read_pictures(json, file.parent_path(), result);
  } catch (const Json::exception& error) {
    throw Error(
        fmt::format("{}: is not what 'substep approve' writes: put back what it wrote, or delete it ({})",
                    file.string(), error.what()));
  }
  return result;
}

Json to_json(const MadeWith& made_with) {
  return {{"renderer", made_with.renderer},
          {"pinned", made_with.is_pinned},
          {"compiler", made_with.compiler},
          {"processor", made_with.processor},
          {"commit", made_with.commit}};
}

Json make_sidecar(const SuiteCase& entry, const PoseLog& log, const Scene& scene,
                  std::span<const ApprovablePicture> pictures, const MadeWith& made_with) {
  Json images = Json::array();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Image& picture = *pictures[i].picture;
    std::array<double, 3> sum{};
    for (std::size_t k = 0; k < picture.rgb.size(); ++k) sum[k % 3] += picture.rgb[k];
    Json mean = Json::array();
    for (const double s : sum) mean.push_back(std::round(s / (picture.width * picture.height) * 100) / 100);
    images.push_back({{"frame", entry.images[i]},
                      {"pixels", pixel_hash(picture)},
                      {"mean_color", mean},
                      {"bodies", to_json(pictures[i].bodies)}});
  }
  return {{"format", sidecar_format},
          {"case", entry.name},
          {"scene", entry.scene.filename().string()},
          {"scene_hash", fmt::format("{:016x}", scene.hash)},
          {"settings", to_json(entry.settings)},
          {"frames", entry.frames},
          {"poses",
           {{"first", fmt::format("{:016x}", log.frames.front().hash)},
            {"last", fmt::format("{:016x}", log.frames.back().hash)}}},
          {"size", {entry.width, entry.height}},
          {"images", images},
          {"made_with", to_json(made_with)}};
}

std::string provenance_differences(const Sidecar& sidecar, const MadeWith& here) {
  std::string text;
  if (!sidecar.made_with.is_object()) return text;
  const Json mine = to_json(here);
  for (const char* key : {"renderer", "compiler", "processor"}) {
    // Nothing was drawn where only poses were checked.
    const auto here_too = mine.at(key).get<std::string>();
    const std::string golden = sidecar.made_with.value(key, std::string());
    if (golden == here_too || here_too.empty()) continue;
    text += fmt::format("{}{} {}, here {}", text.empty() ? "golden made with " : "; ", key, golden, here_too);
  }
  return text;
}

std::string pixel_hash(const Image& image) {
  return fmt::format("{:016x}", hash(image));
}

}  // namespace substep
