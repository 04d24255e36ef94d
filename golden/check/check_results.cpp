#include "golden/check/check_results.h"

#include <fmt/format.h>

#include <cmath>

#include "golden/suite/sidecar.h"
#include "sim/error.h"
#include "sim/loading/parse_json.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* results_format = "substep check results 3";

Json to_json(const Blame& blame) {
  Json bodies = Json::array();
  for (const BodyBlame& b : blame.bodies) {
    bodies.push_back({{"body", b.body},
                      {"name", b.name},
                      {"differing", b.differing},
                      {"levels", b.levels},
                      {"pixels", b.pixels},
                      {"gone", b.is_gone}});
  }
  return {{"foreground", blame.foreground},
          {"differing_foreground", blame.differing_foreground},
          {"everywhere", blame.is_everywhere},
          {"bodies", bodies}};
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
  if (comparison.blame) json["blame"] = to_json(*comparison.blame);
  return json;
}

Json to_json(const MotionComparison& motion) {
  Json errors = Json::array();
  for (const MotionComparison::Error& e : motion.errors) {
    // Runs that blow up have errors that are no numbers in JSON.
    const auto finite = [](double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); };
    errors.push_back({e.frame, finite(e.position), finite(e.pixels)});
  }
  const FirstChange& first = motion.first;
  return {{"judgement", name(motion.judgement)},
          {"first_frame", first.frame},
          {"first_bodies", first.bodies},
          {"body", first.body},
          {"axis", std::string(1, first.axis)},
          {"size", first.size},
          {"size_frame", first.size_frame},
          {"change", change_text(first)},
          {"contacts_frame", motion.contacts_frame},
          {"limit_frame", motion.limit_frame},
          {"limit", motion.limit},
          {"predicted_frame", motion.predicted_frame},
          {"predicted_body", motion.predicted_body},
          {"errors", errors}};
}

Json to_json(const PoseResult& poses) {
  Json json{{"checked", poses.is_checked}, {"golden", poses.has_golden}, {"pass", poses.passes}};
  if (!poses.is_checked) return json;
  json["frames"] = poses.frames;
  json["end"] = poses.end;
  if (!poses.has_golden) return json;
  const PoseDifference& d = poses.difference;
  json["golden_frames"] = poses.golden_frames;
  json["track"] = poses.has_track;
  json["largest_position"] = d.largest_position;
  json["largest_orientation"] = d.largest_orientation;
  json["headers"] = d.headers;
  json["visible_frame"] = poses.visible_frame;
  json["visible_is_fact"] = poses.visible_is_fact;
  json["motion"] = to_json(poses.motion);
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

Json to_json(const PicturePair& pair) {
  return {{"about", name(pair.about)},     {"frame", pair.frame},
          {"expected", pair.expected},     {"actual", pair.actual},
          {"difference", pair.difference}, {"flip", pair.flip},
          {"bodies", pair.bodies},         {"comparison", to_json(pair.comparison)}};
}

Json to_json(const ImageTolerance& t) {
  return {
      {"hard", t.hard}, {"level", t.level}, {"count", t.count}, {"mean", t.mean}, {"tile_mean", t.tile_mean}};
}

/// What approve() goes by.
void add_offers(const CheckedCase& checked, Json& json) {
  json["refusal"] = checked.result.refusal;
  json["offers"] = Json::array();
  for (const Offer& offer : checked.offers) {
    json["offers"].push_back({{"from", offer.from.string()},
                              {"from_hash", offer.from_hash},
                              {"to", offer.to.string()},
                              {"to_hash", offer.to_hash}});
  }
  json["alternates"] = Json::array();
  for (const AlternateOffer& offer : checked.alternates) {
    json["alternates"].push_back({{"frame", offer.frame},
                                  {"from", offer.from.string()},
                                  {"from_hash", offer.from_hash},
                                  {"pixels", offer.pixels}});
  }
  json["sidecar_file"] = checked.result.entry.sidecar.string();
  json["sidecar"] = checked.sidecar;
}

Json to_json(const CheckedCase& checked, const CheckOptions& options) {
  const CaseResult& result = checked.result;
  Json json{{"name", result.entry.name},
            {"scene", result.entry.scene.string()},
            {"verdict", name(result.verdict)},
            {"meaning", meaning(result)},
            {"step", result.step},
            {"size", {result.entry.width, result.entry.height}},
            {"settings", to_json(result.entry.settings)},
            {"tolerance", to_json(result.entry.tolerance)},
            {"poses", to_json(result.poses)},
            {"images", Json::array()},
            {"notes", result.notes},
            {"files", result.files.string()}};
  for (const ImageResult& image : result.images) json["images"].push_back(to_json(image));
  if (result.verdict != Verdict::pass) {
    json["pairs"] = Json::array();
    for (const PicturePair& pair : result.pairs) json["pairs"].push_back(to_json(pair));
    json["golden_made_with"] = read_sidecar(result.entry.sidecar).made_with;
    json["text"] = explain(result, options);
    json["replay"] = replay_command(result, options);
    json["approve"] = approve_command(result, options);
    if (result.has_alternates) json["alternate"] = alternate_command(result, options);
  }
  if (result.verdict != Verdict::pass || !checked.offers.empty()) add_offers(checked, json);
  return json;
}

void read_offers(const Json& json, CheckResults::Case& result) {
  result.refusal = json.at("refusal");
  result.sidecar_file = json.at("sidecar_file").get<std::string>();
  result.sidecar = json.at("sidecar");
  for (const Json& offer : json.at("offers")) {
    result.offers.push_back({offer.at("from").get<std::string>(), offer.at("from_hash"),
                             offer.at("to").get<std::string>(), offer.at("to_hash")});
  }
  for (const Json& offer : json.at("alternates")) {
    result.alternates.push_back(
        {offer.at("frame"), offer.at("from").get<std::string>(), offer.at("from_hash"), offer.at("pixels")});
  }
}

Json to_json(const DistanceMatrix& matrix) {
  return {
      {"scene", matrix.scene}, {"cases", matrix.cases}, {"before", matrix.before}, {"after", matrix.after}};
}

}  // namespace

fs::path results_file(const fs::path& output) {
  return output / "results.json";
}

Json results_json(const CheckResult& result, const std::vector<CheckedCase>& cases) {
  Json json{{"format", results_format},
            {"suite", result.options.suite.string()},
            {"suite_hash", content_hash(read_bytes(result.options.suite))},
            {"made_with", to_json(result.made_with)},
            {"totals", totals(result)},
            {"exit_code", result.exit_code()},
            {"cases", Json::array()},
            {"orphans", Json::array()},
            {"distances", Json::array()}};
  for (const CheckedCase& checked : cases) json["cases"].push_back(to_json(checked, result.options));
  for (const fs::path& orphan : result.orphans) json["orphans"].push_back(orphan.string());
  for (const DistanceMatrix& matrix : result.distances) json["distances"].push_back(to_json(matrix));
  return json;
}

void write_results(const Json& results, const fs::path& output) {
  write_file(results_file(output), results.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

Json read_results_json(const fs::path& output) {
  const fs::path file = results_file(output);
  if (!fs::exists(file)) {
    throw Error(
        fmt::format("{}: not there: run 'substep check' first, and look at what it shows", file.string()));
  }
  try {
    Json json = parse_json<Json>(read_bytes(file), file.string());
    if (json.at("format") != results_format) {
      throw Error(
          fmt::format("{}: is of another version of substep: run 'substep check' again", file.string()));
    }
    return json;
  } catch (const Json::exception& error) {
    throw Error(fmt::format("{}: is damaged: run 'substep check' again ({})", file.string(), error.what()));
  }
}

CheckResults read_results(const fs::path& output) {
  const Json json = read_results_json(output);
  try {
    CheckResults results;
    results.suite_hash = json.at("suite_hash");
    results.made_with = json.at("made_with");
    for (const Json& entry : json.at("cases")) {
      CheckResults::Case result;
      result.name = entry.at("name");
      result.verdict = entry.at("verdict");
      result.poses_pass = entry.at("poses").at("pass");
      if (entry.contains("offers")) read_offers(entry, result);
      results.cases.push_back(std::move(result));
    }
    return results;
  } catch (const Json::exception& error) {
    throw Error(fmt::format("{}: is damaged: run 'substep check' again ({})", results_file(output).string(),
                            error.what()));
  }
}

}  // namespace substep
