#include "golden/check_results.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* results_format = "substep check results 1";
constexpr const char* sidecar_format = "substep golden 1";

Json to_json(const MadeWith& made_with) {
  return {{"renderer", made_with.renderer},
          {"pinned", made_with.is_pinned},
          {"compiler", made_with.compiler},
          {"processor", made_with.processor},
          {"commit", made_with.commit}};
}

Json to_json(const Settings& s) {
  return {{"algorithm", name(s.algorithm)},
          {"step", s.step},
          {"substeps", s.substeps},
          {"iterations", s.iterations},
          {"tau", s.tau},
          {"kappa", s.kappa},
          {"joints", name(s.joints)},
          {"relaxation", s.relaxation},
          {"tolerance", s.tolerance}};
}

Json to_json(const PictureComparison& comparison) {
  const ImageComparison& c = comparison.image;
  Json json{{"judgement", name(c.judgement)}, {"pixels", c.pixels}};
  if (c.judgement == Judgement::exact || c.judgement == Judgement::size) return json;
  json["levels"] = c.levels;
  json["above"] = c.above;
  json["above_tolerated_level"] = c.above_level;
  json["max"] = c.max;
  json["max_at"] = {c.max_x, c.max_y};
  json["mean"] = c.mean;
  json["box"] = {c.left, c.top, c.right, c.bottom};
  json["tile_at"] = {c.tile_x, c.tile_y};
  json["tile_mean"] = c.tile_mean;
  if (comparison.flip) {
    json["flip"] = {{"mean", comparison.flip->mean},
                    {"percentile_99", comparison.flip->percentile_99},
                    {"max", comparison.flip->max},
                    {"visibility", comparison.flip->visibility}};
  }
  return json;
}

Json to_json(const PoseResult& poses) {
  Json json{{"checked", poses.is_checked}, {"golden", poses.has_golden}, {"pass", poses.passes}};
  if (!poses.is_checked) return json;
  const PoseDifference& d = poses.difference;
  json["frames"] = poses.frames;
  json["end"] = poses.end;
  if (!poses.has_golden) return json;
  json["golden_frames"] = poses.golden_frames;
  json["first_frame"] = d.first_frame;
  json["first_full_frame"] = d.first_full_frame;
  json["body"] = poses.body;
  json["axis"] = std::string(1, d.axis);
  json["size"] = d.size;
  json["largest_position"] = d.largest_position;
  json["largest_orientation"] = d.largest_orientation;
  json["headers"] = d.headers;
  return json;
}

Json to_json(const ImageResult& image) {
  Json json{{"frame", image.frame},
            {"golden", image.has_golden},
            {"drawn", image.is_drawn},
            {"pass", image.passes},
            {"blank", image.is_blank}};
  if (image.against_golden) json["against_golden"] = to_json(*image.against_golden);
  if (image.new_poses) json["new_poses"] = to_json(*image.new_poses);
  return json;
}

Json to_json(const CheckedCase& checked, const CheckOptions& options) {
  const CaseResult& result = checked.result;
  Json json{{"name", result.entry.name},       {"scene", result.entry.scene.string()},
            {"verdict", name(result.verdict)}, {"settings", to_json(result.entry.settings)},
            {"poses", to_json(result.poses)},  {"images", Json::array()},
            {"notes", result.notes},           {"files", result.files.string()}};
  for (const ImageResult& image : result.images) json["images"].push_back(to_json(image));
  if (result.verdict == Verdict::pass) return json;
  json["text"] = explain(result, options);
  json["refusal"] = result.refusal;
  json["offers"] = Json::array();
  for (const Offer& offer : checked.offers) {
    json["offers"].push_back({{"from", offer.from.string()},
                              {"from_hash", offer.from_hash},
                              {"to", offer.to.string()},
                              {"to_hash", offer.to_hash}});
  }
  json["sidecar_file"] = result.entry.sidecar.string();
  json["sidecar"] = checked.sidecar;
  return json;
}

}  // namespace

fs::path results_file(const fs::path& output) {
  return output / "results.json";
}

void write_results(const CheckResult& result, const std::vector<CheckedCase>& cases) {
  Json json{{"format", results_format},
            {"suite", result.options.suite.string()},
            {"suite_hash", content_hash(read_bytes(result.options.suite))},
            {"made_with", to_json(result.made_with)},
            {"totals", totals(result)},
            {"exit_code", result.exit_code()},
            {"cases", Json::array()},
            {"orphans", Json::array()}};
  for (const CheckedCase& checked : cases) json["cases"].push_back(to_json(checked, result.options));
  for (const fs::path& orphan : result.orphans) json["orphans"].push_back(orphan.string());
  write_file(results_file(result.options.output), json.dump(1) + "\n");
}

CheckResults read_results(const fs::path& output) {
  const fs::path file = results_file(output);
  if (!fs::exists(file)) {
    throw Error(
        fmt::format("{}: not there: run 'substep check' first, and look at what it shows", file.string()));
  }
  try {
    const Json json = Json::parse(read_bytes(file));
    if (json.at("format") != results_format) {
      throw Error(
          fmt::format("{}: is of another version of substep: run 'substep check' again", file.string()));
    }
    CheckResults results;
    results.suite_hash = json.at("suite_hash");
    results.is_pinned = json.at("made_with").at("pinned");
    for (const Json& entry : json.at("cases")) {
      CheckResults::Case result;
      result.name = entry.at("name");
      result.verdict = entry.at("verdict");
      if (result.verdict != name(Verdict::pass)) {
        result.refusal = entry.at("refusal");
        result.sidecar_file = entry.at("sidecar_file").get<std::string>();
        result.sidecar = entry.at("sidecar");
        for (const Json& offer : entry.at("offers")) {
          result.offers.push_back({offer.at("from").get<std::string>(), offer.at("from_hash"),
                                   offer.at("to").get<std::string>(), offer.at("to_hash")});
        }
      }
      results.cases.push_back(std::move(result));
    }
    return results;
  } catch (const Json::exception& error) {
    throw Error(fmt::format("{}: is damaged: run 'substep check' again ({})", file.string(), error.what()));
  }
}

Json make_sidecar(const CaseResult& result, const PoseLog& log, const Scene& scene,
                  std::span<const Image* const> pictures, const MadeWith& made_with) {
  const SuiteCase& entry = result.entry;
  Json images = Json::array();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Image& picture = *pictures[i];
    std::array<double, 3> sum{};
    for (std::size_t k = 0; k < picture.rgb.size(); ++k) sum[k % 3] += picture.rgb[k];
    Json mean = Json::array();
    for (const double s : sum) mean.push_back(std::round(s / (picture.width * picture.height) * 100) / 100);
    images.push_back({{"frame", entry.images[i]}, {"pixels", pixel_hash(picture)}, {"mean_color", mean}});
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

std::string approved_pixels(const fs::path& sidecar, int frame) {
  try {
    if (!fs::exists(sidecar)) return {};
    const Json json = Json::parse(read_bytes(sidecar));
    for (const Json& image : json.at("images")) {
      if (image.at("frame") == frame) return image.at("pixels");
    }
  } catch (const Json::exception&) {
    // A sidecar is context: one that cannot be read says nothing.
  }
  return {};
}

std::string provenance_differences(const fs::path& sidecar, const MadeWith& here) {
  std::string text;
  try {
    if (!fs::exists(sidecar)) return {};
    const Json golden = Json::parse(read_bytes(sidecar)).at("made_with");
    const Json mine = to_json(here);
    for (const char* key : {"renderer", "compiler", "processor"}) {
      // Nothing was drawn where only poses were checked.
      const auto here_too = mine.at(key).get<std::string>();
      if (golden.at(key) == here_too || here_too.empty()) continue;
      text += fmt::format("{}{} {}, here {}", text.empty() ? "golden made with " : "; ", key,
                          golden.at(key).get<std::string>(), here_too);
    }
  } catch (const Json::exception&) {
    return {};
  }
  return text;
}

std::string pixel_hash(const Image& image) {
  return fmt::format("{:016x}", hash(image));
}

}  // namespace substep
