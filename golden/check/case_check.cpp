#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <new>

#include "golden/check/case_context.h"
#include "render/player/player_page.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_table.h"
#include "sim/simulation.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

std::string one_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  std::string line;
  for (const char c : text) line += c == '\n' ? std::string("; ") : std::string(1, c);
  return line;
}

bool has_equal_track(const CaseContext& work) {
  return work.golden_track && to_bytes(*work.golden_track) == to_bytes(*work.live_track);
}

/// Returns the hash of the track's file after approval. Equal tracks may be deflated differently.
std::string approved_track_hash(const CaseContext& work) {
  return content_hash(has_equal_track(work) ? read_bytes(work.result.entry.track_file)
                                            : to_bytes(*work.live_track));
}

/// Returns true where all golden pictures equal the pictures drawn here: only then may the sidecar be
/// rewritten.
bool draws_its_goldens(const CaseContext& work) {
  const auto& images = work.result.images;
  return (images.empty() || work.is_exact_here()) && std::ranges::all_of(images, [](const auto& image) {
           return image.against_golden && image.against_golden->image.judgement == Judgement::exact;
         });
}

/// Returns true where sidecar and track of a case that passes agree with its run.
bool is_up_to_date(const CaseContext& work) {
  // A run within its tolerance is no reason to rewrite the sidecar.
  if (!work.live || work.result.poses.motion.judgement != PoseJudgement::exact) return true;
  return work.sidecar.scene_hash == hash_text(work.scene.hash) &&
         work.sidecar.parts == scene_parts(work.scene) &&
         work.sidecar.pose_log_hash == content_hash(to_text(*work.live)) &&
         work.sidecar.track_hash == approved_track_hash(work);
}

/// Writes a page that plays the run beside the golden one where the motion differs, for people who have the
/// check's folder but not the program.
void write_motion_page(CaseContext& work) {
  CaseResult& result = work.result;
  const bool differs = work.golden && work.golden_track && work.live_track && !result.poses.passes;
  if (result.verdict == Verdict::pass || !differs) return;
  render::Comparison comparison;
  render::ReferenceRun golden;
  golden.method = "the golden run";
  for (int k = 0; k <= result.entry.frames; ++k) comparison.times.push_back(k * result.entry.settings.step);
  for (const Track::Frame& frame : work.golden_track->frames) {
    if (frame.poses.size() != work.scene.bodies.size())
      return work.note("no motion page: the golden run has other bodies");
    if (golden.poses.size() < comparison.times.size()) golden.poses.push_back(frame.poses);
  }
  golden.known = golden.poses.size();
  comparison.runs.resize(2);
  render::Run& now = comparison.runs[0];
  now.panel.settings = result.entry.settings;
  now.panel.author = result.entry.author;
  if (!now.panel.author.empty()) now.panel.kind = render::PanelChoice::Kind::log;
  now.panel.title = "as it runs now";
  for (const Track::Frame& frame : work.live_track->frames) now.poses.push_back(frame.poses);
  render::measure_from(work.scene, golden, now);
  if (now.poses.size() < comparison.times.size()) now.diverged = comparison.times[now.poses.size()];
  render::Run& before = comparison.runs[1];
  before.panel.kind = render::PanelChoice::Kind::reference;
  before.poses = golden.poses;
  comparison.reference = std::move(golden);
  comparison.strip = render::Strip::error;
  result.player = "player.html";
  work.write(result.player, render::player_page(work.scene, comparison, work.scene.name, 1));
}

/// Returns the log of a run made elsewhere.
PoseLog foreign_log(const CaseContext& work, Tracker& tracker) {
  const SuiteCase& entry = work.result.entry;
  const double step = entry.settings.step;
  std::vector<State> states;
  if (entry.command.empty()) {
    states = read_pose_table(entry.poses, work.scene, step);
  } else {
    Scene scene = work.scene;
    scene.duration = entry.frames * step;
    states = run_command(entry.command, scene, entry.settings, entry.time_limit);
  }
  states.resize(std::min(states.size(), static_cast<std::size_t>(entry.frames) + 1));
  for (const State& state : states) tracker.add(state);
  PoseLog log = log_of(states, work.scene, step, entry.author);
  log.full_every = entry.full_every;
  for (std::size_t k = 0; k + 1 < log.frames.size(); ++k) {
    if (k % static_cast<std::size_t>(entry.full_every) != 0) log.frames[k].poses.clear();
  }
  return log;
}

/// Returns the log of a run by one of our algorithms.
PoseLog own_log(const CaseContext& work, Tracker& tracker) {
  const SuiteCase& entry = work.result.entry;
  Simulation simulation(work.scene, entry.settings);
  tracker.add(simulation.state());
  return record(simulation, entry.frames, entry.full_every,
                [&](int, const StepReport&) { tracker.add(simulation.state()); });
}

void add_candidate(const fs::path& from, const fs::path& to, CaseResult& result) {
  result.candidates.push_back({from, content_hash(read_bytes(from)), to,
                               fs::exists(to) ? content_hash(read_bytes(to)) : std::string()});
}

void add_log_candidates(CaseContext& work) {
  const PoseResult& poses = work.result.poses;
  // A run within its tolerance is no reason for another golden.
  if (poses.passes && poses.motion.judgement != PoseJudgement::exact) return;
  const SuiteCase& entry = work.result.entry;
  const std::string text = to_text(*work.live);
  if (!poses.has_golden || text != read_bytes(entry.pose_file))
    add_candidate(work.write("actual.poses", text), entry.pose_file, work.result);
  if (has_equal_track(work)) return;
  add_candidate(work.write("actual.track", to_bytes(*work.live_track)), entry.track_file, work.result);
}

/// Writes the files that approving would copy. Returns the reason that forbids approving; empty where there
/// is none.
std::string prepare_approval(CaseContext& work) {
  const SuiteCase& entry = work.result.entry;
  add_log_candidates(work);
  const bool from_live = !work.new_images.empty();
  std::vector<Sidecar::Picture> pictures;
  for (std::size_t i = 0; i < entry.images.size(); ++i) {
    const ImageResult& image = work.result.images[i];
    const Drawing& drawing = from_live ? work.new_images[i] : work.drawn[i];
    if (!drawing.is_there()) {
      return fmt::format("the run has no frame {}: it ended \"{}\"", image.frame, work.live->end);
    }
    if (is_blank(drawing.picture)) return fmt::format("frame {} is blank", image.frame);
    pictures.push_back({image.frame, hash_text(hash(drawing.picture)), body_extents(drawing.bodies)});
    const fs::path golden = entry.image_file(image.frame);
    const bool is_unchanged = (image.passes && !from_live) ||
                              (image.has_golden && render::read_png(golden).rgb == drawing.picture.rgb);
    if (is_unchanged) continue;
    const std::string file = fmt::format("f{:04}.{}.png", image.frame, from_live ? "new" : "actual");
    add_candidate(work.result.files / file, golden, work.result);
  }
  work.result.sidecar =
      make_sidecar(entry, *work.live, approved_track_hash(work), work.scene, pictures, work.made_with);
  if (entry.images.empty() || work.made_with.is_pinned || entry.any_renderer) return {};
  return "it was drawn by " + work.made_with.renderer + ", which is not the pinned renderer";
}

/// Removes stale files from the case's folder.
void clear(const fs::path& folder) {
  std::error_code none;
  for (const auto& file : fs::directory_iterator(folder, none)) {
    for (const char* const extension : {".png", ".poses", ".track", ".html"}) {
      if (file.path().extension() == extension) fs::remove(file.path());
    }
  }
}

/// Reads sidecar, golden log and track, and notes which of them are not those that were approved. Throws
/// Error when one is damaged.
void load_goldens(CaseContext& work) {
  const SuiteCase& entry = work.result.entry;
  work.sidecar = read_sidecar(entry.sidecar);
  work.result.poses.has_golden = fs::exists(entry.pose_file);
  if (work.result.poses.has_golden) work.golden = read_pose_log(entry.pose_file);
  if (fs::exists(entry.track_file)) work.golden_track = read_track(entry.track_file);
  if (!work.sidecar.is_there) return;
  const auto compare = [&](const fs::path& file, const std::string& approved) {
    if (content_hash(read_bytes(file)) == approved) return;
    work.edited.push_back(file.filename().string());
    work.note(fmt::format("the golden {} is not the one that was approved", work.edited.back()));
  };
  if (work.golden) compare(entry.pose_file, work.sidecar.pose_log_hash);
  if (work.golden_track) compare(entry.track_file, work.sidecar.track_hash);
}

/// Simulates, and compares with the golden log.
void check_poses(CaseContext& work) {
  PoseResult& poses = work.result.poses;
  const SuiteCase& entry = work.result.entry;
  Tracker tracker(work.scene, entry.settings);
  work.live = entry.author.empty() ? own_log(work, tracker) : foreign_log(work, tracker);
  work.live_track = tracker.take();
  poses.frames = static_cast<int>(work.live->frames.size());
  poses.end = work.live->end;
  poses.bodies = static_cast<int>(work.live->bodies.size()) - 1;
  if (!entry.author.empty() && poses.frames <= entry.frames)
    work.note(fmt::format("the table ends at frame {}, the case at {}", poses.frames - 1, entry.frames));
  if (!work.golden) return;
  poses.golden_frames = static_cast<int>(work.golden->frames.size());
  poses.difference = compare(*work.golden, *work.live);
  if (poses.difference.first_frame >= 0) {
    poses.motion = compare_motion(work.golden_motion(), work.live_motion(), entry.pose_tolerance);
  } else if (poses.difference.largest_position != 0 || poses.difference.largest_orientation != 0) {
    poses.motion.judgement = PoseJudgement::differs;
    work.note("the golden log's poses do not match its hashes: it was edited");
  }
  poses.passes = passes(poses.motion.judgement);
  if (poses.motion.judgement == PoseJudgement::within) {
    work.note(fmt::format("poses differ from frame {} on, within the case's pose tolerance",
                          poses.motion.first.frame));
  }
  if (poses.motion.judgement == PoseJudgement::exact && !poses.difference.headers.empty()) {
    work.note("same states, but the pose log's header differs: " + one_line(poses.difference.headers));
  }
}

}  // namespace

fs::path CaseContext::write(const std::string& name, std::string_view bytes) const {
  fs::create_directories(result.files);
  write_file(result.files / name, bytes);
  return result.files / name;
}

CaseChecker::CaseChecker(const CheckPlan& plan)
    : output_(plan.options.output),
      made_with_(golden::made_with(
          std::ranges::any_of(plan.cases, [](const SuiteCase& entry) { return !entry.images.empty(); }))) {}

CaseResult CaseChecker::check(const SuiteCase& entry) {
  try {
    if (!scene_ || scene_file_ != entry.scene) {
      scene_.reset();
      scene_.emplace(load_scene(entry.scene));
      scene_file_ = entry.scene;
    }
    const auto start = std::chrono::steady_clock::now();
    CaseContext work{made_with_, *scene_};
    CaseResult& result = work.result;
    result.entry = entry;
    result.entry.settings = entry.settings_for(*scene_);
    result.files = output_ / entry.name;
    clear(result.files);
    load_goldens(work);
    check_poses(work);
    if (!entry.images.empty()) check_images(work);
    decide(work);
    write_motion_page(work);
    const bool has_nothing_to_approve =
        result.verdict == Verdict::pass && (is_up_to_date(work) || !draws_its_goldens(work));
    if (!has_nothing_to_approve) result.refusal = prepare_approval(work);
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return std::move(result);
  } catch (const std::bad_alloc&) {
    return failed_case(output_, entry, "there is not enough memory for it");
  } catch (const std::exception& error) {
    return failed_case(output_, entry, error.what());
  }
}

CaseResult failed_case(const fs::path& output, const SuiteCase& entry, const std::string& why) {
  CaseResult result;
  result.entry = entry;
  result.files = output / entry.name;
  clear(result.files);
  result.verdict = Verdict::error;
  result.cause = one_line(why);
  result.refusal = "it could not be checked";
  return result;
}

}  // namespace substep::golden
