#include "golden/check/check_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "golden/suite/sidecar.h"
#include "sim/error.h"
#include "sim/loading/parse_json.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* results_format = "substep check results 6";

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
  json["bodies"] = poses.bodies;
  json["modelled"] = poses.modelled;
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
  Json json{
      {"hard", t.hard}, {"level", t.level}, {"count", t.count}, {"mean", t.mean}, {"tile_mean", t.tile_mean}};
  if (t.flip) json["flip"] = *t.flip;
  return json;
}

/// What approve() goes by.
void add_candidates(const CheckedCase& checked, Json& json) {
  const fs::path output = checked.result.files.parent_path();
  const fs::path suite_folder = checked.result.entry.suite_folder;
  json["candidates"] = Json::array();
  for (const ApprovalCandidate& candidate : checked.candidates) {
    json["candidates"].push_back({{"from", below(candidate.from, output)},
                                  {"from_hash", candidate.from_hash},
                                  {"to", below(candidate.to, suite_folder)},
                                  {"to_hash", candidate.to_hash}});
  }
  json["sidecar_file"] = below(checked.result.entry.sidecar, suite_folder);
  if (checked.sidecar.is_object()) json["sidecar"] = checked.sidecar;
}

}  // namespace

Json to_json(const CheckedCase& checked) {
  const CaseResult& result = checked.result;
  Json json{{"name", result.entry.name},
            {"scene", result.entry.scene.string()},
            {"verdict", name(result.verdict)},
            {"meaning", meaning(result)},
            {"cause", result.cause},
            {"seconds", std::round(result.seconds * 1000) / 1000},
            {"step", result.step},
            {"size", {result.entry.width, result.entry.height}},
            {"settings", to_json(result.entry.settings)},
            {"tolerance", to_json(result.entry.tolerance)},
            {"poses", to_json(result.poses)},
            {"images", Json::array()},
            {"notes", result.notes},
            {"files", result.files.filename().string()}};
  for (const ImageResult& image : result.images) json["images"].push_back(to_json(image));
  json["refusal"] = result.refusal;
  if (result.verdict != Verdict::pass) {
    json["pairs"] = Json::array();
    for (const PicturePair& pair : result.pairs) json["pairs"].push_back(to_json(pair));
    if (!result.player.empty()) json["player"] = result.player;
    json["golden_made_with"] = checked.golden_made_with;
    json["text"] = explain(result);
  }
  const bool has_candidates = result.verdict != Verdict::pass && result.verdict != Verdict::error;
  if (has_candidates || checked.sidecar.is_object()) add_candidates(checked, json);
  return json;
}

std::string below(const fs::path& file, const fs::path& folder) {
  return file.lexically_normal().lexically_relative(folder.lexically_normal()).generic_string();
}

fs::path results_file(const fs::path& output) {
  return output / "results.json";
}

Json empty_results(const Suite& suite, const CheckOptions& options, std::size_t cases) {
  return {{"format", results_format},
          {"suite", suite.file.string()},
          {"suite_hash", content_hash(read_bytes(suite.file))},
          {"only", options.cases},
          {"ended", false},
          {"of", cases},
          {"made_with", to_json(MadeWith())},
          {"totals", ""},
          {"exit_code", 1},
          {"cases", Json::array()},
          {"orphans", Json::array()}};
}

void sum_up(Json& results) {
  std::vector<Verdict> found;
  for (const Json& entry : results.at("cases")) {
    found.push_back(verdict_named(entry.at("verdict").get<std::string>()).value_or(Verdict::error));
  }
  const std::size_t orphans = results.at("orphans").size();
  results["totals"] = totals(found, orphans);
  results["exit_code"] = exit_code(found, orphans);
}

void write_results(const Json& results, const fs::path& output) {
  write_file(results_file(output), results.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

Json read_results(const fs::path& output) {
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

}  // namespace substep::golden
