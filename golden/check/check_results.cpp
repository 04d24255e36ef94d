#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <thread>

#include "golden/check/case_context.h"
#include "golden/report/report.h"
#include "sim/error.h"
#include "sim/loading/json_value.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

constexpr const char* results_format = "substep check results 8";

Json to_json(const PictureComparison& comparison) {
  const ImageComparison& c = comparison.image;
  Json json{{"judgement", name(c.judgement)}, {"pixels", c.pixels}};
  if (c.judgement == Judgement::exact || c.judgement == Judgement::size) return json;
  json["differing"] = c.differing;
  json["above_tolerated_level"] = c.above_level;
  json["max"] = c.max;
  if (const auto& flip = comparison.flip)
    json["flip"] = {{"mean", flip->mean}, {"max", flip->max}, {"visibility", visibility(*flip)}};
  return json;
}

Json to_json(const PoseResult& poses) {
  Json json{{"golden", poses.has_golden},
            {"pass", poses.passes},
            {"frames", poses.frames},
            {"end", poses.end},
            {"bodies", poses.bodies}};
  if (!poses.has_golden) return json;
  const MotionComparison& motion = poses.motion;
  json["golden_frames"] = poses.golden_frames;
  json["largest_position"] = poses.difference.largest_position;
  json["largest_orientation"] = poses.difference.largest_orientation;
  json["headers"] = poses.difference.headers;
  json["visible_frame"] = poses.visible_frame;
  json["visible_frame_is_certain"] = poses.visible_frame_is_certain;
  json["motion"] = {{"judgement", name(motion.judgement)},
                    {"first_frame", motion.first.frame},
                    {"body", motion.first.body},
                    {"change", change_text(motion.first)},
                    {"contacts_frame", motion.contacts_frame},
                    {"limit_frame", motion.limit_frame},
                    {"limit", motion.limit}};
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
  constexpr std::array<const char*, 4> abouts{"renderer", "simulation", "first visible", "only"};
  return {{"about", abouts[static_cast<std::size_t>(pair.about)]},
          {"frame", pair.frame},
          {"expected", pair.expected},
          {"actual", pair.actual},
          {"flip", pair.flip},
          {"comparison", to_json(pair.comparison)}};
}

/// Returns the path of `file` relative to `folder`, which contains the file.
std::string below(const fs::path& file, const fs::path& folder) {
  return file.lexically_normal().lexically_relative(folder.lexically_normal()).generic_string();
}

/// Adds the files that approve() copies and the sidecar that it writes.
void add_candidates(const CaseResult& result, Json& json) {
  const fs::path suite_folder = result.entry.suite_folder;
  json["candidates"] = Json::array();
  for (const ApprovalCandidate& candidate : result.candidates) {
    json["candidates"].push_back({{"from", below(candidate.from, result.files.parent_path())},
                                  {"from_hash", candidate.from_hash},
                                  {"to", below(candidate.to, suite_folder)},
                                  {"to_hash", candidate.to_hash}});
  }
  json["sidecar_file"] = below(result.entry.sidecar, suite_folder);
  if (result.sidecar.is_object()) json["sidecar"] = result.sidecar;
}

/// Locks a file. Returns false where another process holds the lock for over 2 s, the longest that the worker
/// of an ended check takes to remove unfinished files.
bool take_lock(int file) {
  constexpr int tries = 40;
  for (int i = 0; i < tries; ++i) {
    if (::flock(file, LOCK_EX | LOCK_NB) == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

}  // namespace

Json to_json(const CaseResult& result) {
  Json json{{"name", result.entry.name},
            {"scene", result.entry.scene.string()},
            {"verdict", name(result.verdict)},
            {"meaning", meaning(result)},
            {"cause", result.cause},
            {"seconds", std::round(result.seconds * 1000) / 1000},
            {"step", result.entry.settings.step},
            {"size", {result.entry.width, result.entry.height}},
            {"settings", run_settings(result.entry)},
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
    json["text"] = explain(result);
  }
  const bool has_candidates = result.verdict != Verdict::pass && result.verdict != Verdict::error;
  if (has_candidates || result.sidecar.is_object()) add_candidates(result, json);
  return json;
}

fs::path results_file(const fs::path& output) {
  return output / "results.json";
}

Json read_results(const fs::path& output) {
  const fs::path file = results_file(output);
  const auto refuse = [&](const std::string& why) { throw Error("{}: {}", file.string(), why); };
  if (!fs::exists(file)) refuse("not there: run 'substep check' first, and look at what it shows");
  try {
    Json json = parse_json(read_bytes(file), file.string());
    if (json.at("format") != results_format)
      refuse("is of another version of substep: run 'substep check' again");
    return json;
  } catch (const Json::exception& error) {
    throw Error("{}: is damaged: run 'substep check' again ({})", file.string(), error.what());
  }
}

CheckOutput::CheckOutput(fs::path folder) : folder_(std::move(folder)) {
  std::error_code failure;
  fs::create_directories(folder_, failure);
  if (failure && !fs::is_directory(folder_))
    throw Error("{}: this folder cannot be made: {}", folder_.string(), failure.message());
  lock_ = ::open((folder_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) throw Error("{}: cannot be written to: {}", folder_.string(), std::strerror(errno));
  if (!take_lock(lock_)) {
    ::close(lock_);
    throw Error("{}: another check is writing there: give this one an --output of its own", folder_.string());
  }
}

CheckOutput::~CheckOutput() {
  ::close(lock_);
}

void CheckOutput::start(const CheckPlan& plan) {
  std::error_code ignored;
  fs::remove(report_file(folder_), ignored);
  results_ = {{"format", results_format},
              {"suite", plan.suite.file.string()},
              {"suite_hash", content_hash(read_bytes(plan.suite.file))},
              {"only", plan.options.cases},
              {"ended", false},
              {"of", plan.cases.size()},
              {"made_with", to_json(MadeWith())},
              {"totals", ""},
              {"exit_code", 1},
              {"cases", Json::array()},
              {"orphans", Json::array()}};
  write();
}

void CheckOutput::add_case(const Json& entry) {
  results_["cases"].push_back(entry);
  // Write at most once a second, since a suite has many short cases.
  if (Clock::now() - last_written_ >= std::chrono::seconds(1)) write();
}

void CheckOutput::write() {
  std::vector<Verdict> found;
  for (const Json& entry : results_.at("cases")) {
    found.push_back(verdict_named(entry.at("verdict").get<std::string>()));
  }
  const std::size_t orphans = results_.at("orphans").size();
  results_["totals"] = totals(found, orphans);
  results_["exit_code"] = results_.at("ended").get<bool>() ? exit_code(found, orphans) : 1;
  write_file(results_file(folder_), results_.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  write_junit(results_, folder_);
  last_written_ = Clock::now();
}

void CheckOutput::finish(const std::vector<fs::path>& orphans) {
  const fs::path suite_folder = fs::path(results_.at("suite").get<std::string>()).parent_path();
  for (const fs::path& orphan : orphans) results_["orphans"].push_back(below(orphan, suite_folder));
  results_["ended"] = true;
  write();
  write_report(results_, folder_);
}

}  // namespace substep::golden
