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

bool has_equal_track(const CaseContext& context) {
  return context.golden_track && to_bytes(*context.golden_track) == to_bytes(*context.live_track);
}

/// Returns the hash of the track's file after approval. Equal tracks may be deflated differently.
std::string approved_track_hash(const CaseContext& context) {
  return content_hash(has_equal_track(context) ? read_bytes(context.result.entry.track_file)
                                               : to_bytes(*context.live_track));
}

/// Returns true where all golden pictures equal the pictures drawn here: only then may the sidecar be
/// rewritten.
bool draws_its_goldens(const CaseContext& context) {
  const auto& images = context.result.images;
  return (images.empty() || context.is_exact_here()) && std::ranges::all_of(images, [](const auto& image) {
           return image.against_golden && image.against_golden->image.judgement == Judgement::exact;
         });
}

/// Returns true where sidecar and track of a case that passes agree with its run.
bool is_up_to_date(const CaseContext& context) {
  // A run within its tolerance is no reason to rewrite the sidecar.
  if (context.result.poses.motion.judgement != PoseJudgement::exact) return true;
  return context.sidecar.scene_hash == hash_text(context.scene.hash) &&
         context.sidecar.parts == scene_parts(context.scene) &&
         context.sidecar.pose_log_hash == content_hash(to_text(*context.live)) &&
         context.sidecar.track_hash == approved_track_hash(context);
}

/// Writes a page that plays the run beside the golden one where the motion differs, for people who have the
/// check's folder but not the program.
void write_motion_page(CaseContext& context) {
  CaseResult& result = context.result;
  const bool differs = context.golden && context.golden_track && !result.poses.passes;
  if (result.verdict == Verdict::pass || !differs) return;
  if (context.golden->settings.step != result.entry.settings.step)
    return context.note("no motion page: the golden run has another step");
  render::Comparison comparison;
  render::ReferenceRun golden;
  golden.method = "the golden run";
  golden.fate = "the golden run ends";
  for (int k = 0; k <= result.entry.frames; ++k) comparison.times.push_back(k * result.entry.settings.step);
  for (const Track::Frame& frame : context.golden_track->frames) {
    if (frame.poses.size() != context.scene.bodies.size())
      return context.note("no motion page: the golden run has other bodies");
    if (golden.poses.size() < comparison.times.size()) golden.poses.push_back(frame.poses);
  }
  golden.known = golden.poses.size();
  golden.uncertainty.assign(golden.known, Track::resolution);
  comparison.runs.resize(2);
  render::Run& now = comparison.runs[0];
  now.panel.settings = result.entry.settings;
  now.panel.author = result.entry.author;
  if (!now.panel.author.empty()) now.panel.kind = render::PanelChoice::Kind::log;
  now.panel.title = "as it runs now";
  for (const Track::Frame& frame : context.live_track->frames) now.poses.push_back(frame.poses);
  render::measure_from(context.scene, golden, now);
  if (context.live->end.starts_with("diverged")) now.diverged = comparison.times[now.poses.size()];
  render::Run& before = comparison.runs[1];
  before.panel.kind = render::PanelChoice::Kind::reference;
  before.poses = golden.poses;
  comparison.reference = std::move(golden);
  comparison.strip = render::Strip::error;
  result.player = "player.html";
  context.write(result.player, render::player_page(context.scene, comparison, context.scene.name, 1));
}

/// Returns the log of a run made by another simulator, and adds its states to the tracker.
PoseLog foreign_log(const CaseContext& context, Tracker& tracker) {
  const SuiteCase& entry = context.result.entry;
  const double step = entry.settings.step;
  std::vector<State> states;
  if (entry.command.empty()) {
    states = read_pose_table(entry.poses, context.scene, step);
  } else {
    Scene scene = context.scene;
    scene.duration = entry.frames * step;
    states = run_command(entry.command, scene, entry.settings, entry.time_limit);
  }
  states.resize(std::min(states.size(), static_cast<std::size_t>(entry.frames) + 1));
  for (const State& state : states) tracker.add(state);
  PoseLog log = log_of(states, context.scene, step, entry.author);
  log.full_every = entry.full_every;
  // Keep every full_every-th frame's poses, and the last frame's.
  for (std::size_t k = 0; k + 1 < log.frames.size(); ++k)
    if (k % static_cast<std::size_t>(entry.full_every) != 0) log.frames[k].poses.clear();
  return log;
}

/// Simulates one of our algorithms. Returns the log, and adds the states to the tracker.
PoseLog own_log(const CaseContext& context, Tracker& tracker) {
  const SuiteCase& entry = context.result.entry;
  Simulation simulation(context.scene, entry.settings);
  tracker.add(simulation.state());
  return record(simulation, entry.frames, entry.full_every,
                [&](int, const StepReport&) { tracker.add(simulation.state()); });
}

void add_candidate(const fs::path& from, const fs::path& to, CaseResult& result) {
  result.candidates.push_back({from, content_hash(read_bytes(from)), to,
                               fs::exists(to) ? content_hash(read_bytes(to)) : std::string()});
}

void add_log_candidates(CaseContext& context) {
  const PoseResult& poses = context.result.poses;
  // A run within its tolerance is no reason for another golden.
  if (poses.passes && poses.motion.judgement != PoseJudgement::exact) return;
  const SuiteCase& entry = context.result.entry;
  const std::string text = to_text(*context.live);
  if (!poses.has_golden || text != read_bytes(entry.pose_file))
    add_candidate(context.write("actual.poses", text), entry.pose_file, context.result);
  if (has_equal_track(context)) return;
  add_candidate(context.write("actual.track", to_bytes(*context.live_track)), entry.track_file,
                context.result);
}

/// Writes the log and track that approval would copy, lists them and the pictures, and makes the sidecar.
/// Returns the reason that forbids approval; empty where there is none.
std::string prepare_approval(CaseContext& context) {
  const SuiteCase& entry = context.result.entry;
  add_log_candidates(context);
  const bool from_live = !context.new_images.empty();
  std::vector<Sidecar::Picture> pictures;
  for (std::size_t i = 0; i < entry.images.size(); ++i) {
    const ImageResult& image = context.result.images[i];
    const Drawing& drawing = from_live ? context.new_images[i] : context.drawn[i];
    if (!drawing.is_there())
      return fmt::format("the run has no frame {}: it ended \"{}\"", image.frame, context.live->end);
    if (is_blank(drawing.picture)) return fmt::format("frame {} is blank", image.frame);
    pictures.push_back({image.frame, hash_text(hash(drawing.picture)), body_extents(drawing.bodies)});
    const fs::path golden = entry.image_file(image.frame);
    const bool is_unchanged = (image.passes && !from_live) ||
                              (image.has_golden && render::read_png(golden).rgb == drawing.picture.rgb);
    if (is_unchanged) continue;
    const std::string file = fmt::format("f{:04}.{}.png", image.frame, from_live ? "new" : "actual");
    add_candidate(context.result.files / file, golden, context.result);
  }
  context.result.sidecar = make_sidecar(entry, *context.live, approved_track_hash(context), context.scene,
                                        pictures, context.made_with);
  if (entry.images.empty() || context.made_with.is_pinned || entry.any_renderer) return {};
  return "it was drawn by " + context.made_with.renderer + ", which is not the pinned renderer";
}

/// Removes stale files from the case's folder.
void clear(const fs::path& folder) {
  std::error_code none;
  for (const auto& file : fs::directory_iterator(folder, none)) {
    for (const char* const extension : {".png", ".poses", ".track", ".html"})
      if (file.path().extension() == extension) fs::remove(file.path());
  }
}

/// Reads sidecar, golden log and track. Notes a log or track whose hash differs from the approved one. Throws
/// Error when a file is damaged, or the track is shorter than the log.
void load_goldens(CaseContext& context) {
  const SuiteCase& entry = context.result.entry;
  context.sidecar = read_sidecar(entry.sidecar);
  context.result.poses.has_golden = fs::exists(entry.pose_file);
  if (context.result.poses.has_golden) context.golden = read_pose_log(entry.pose_file);
  if (fs::exists(entry.track_file)) context.golden_track = read_track(entry.track_file);
  if (context.golden && context.golden_track &&
      context.golden_track->frames.size() < context.golden->frames.size())
    throw Error("{}: has fewer frames than the pose log", entry.track_file.string());
  if (!context.sidecar.is_there) return;
  const auto compare = [&](const fs::path& file, const std::string& approved) {
    if (content_hash(read_bytes(file)) == approved) return;
    context.edited.push_back(file.filename().string());
    context.note(fmt::format("the golden {} differs from the approved one", context.edited.back()));
  };
  if (context.golden) compare(entry.pose_file, context.sidecar.pose_log_hash);
  if (context.golden_track) compare(entry.track_file, context.sidecar.track_hash);
}

/// Simulates, and compares with the golden log.
void check_poses(CaseContext& context) {
  PoseResult& poses = context.result.poses;
  const SuiteCase& entry = context.result.entry;
  Tracker tracker(context.scene, entry.settings);
  context.live = entry.author.empty() ? own_log(context, tracker) : foreign_log(context, tracker);
  context.live_track = tracker.take();
  poses.frames = static_cast<int>(context.live->frames.size());
  poses.end = context.live->end;
  poses.bodies = static_cast<int>(context.live->bodies.size()) - 1;
  if (!entry.author.empty() && poses.frames <= entry.frames)
    context.note(fmt::format("the run ends at frame {}, the case at {}", poses.frames - 1, entry.frames));
  if (!context.golden) return;
  poses.golden_frames = static_cast<int>(context.golden->frames.size());
  poses.difference = compare(*context.golden, *context.live);
  if (poses.difference.first_frame >= 0) {
    poses.motion =
        compare_motion(context.golden_motion(), context.live_motion(), context.scene, entry.pose_tolerance);
  } else if (poses.difference.largest_position != 0 || poses.difference.largest_orientation != 0) {
    poses.motion.judgement = PoseJudgement::not_exact;
    context.note("the golden log's poses do not match its hashes: it was edited");
  }
  poses.passes = passes(poses.motion.judgement);
  if (poses.motion.judgement == PoseJudgement::within) {
    context.note(fmt::format("poses differ from frame {} on, within the case's pose tolerance",
                             poses.motion.first.frame));
  }
  if (poses.motion.judgement == PoseJudgement::exact && !poses.difference.headers.empty())
    context.note("same states, but the pose log's header differs: " + one_line(poses.difference.headers));
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
    CaseContext context{made_with_, *scene_};
    CaseResult& result = context.result;
    result.entry = entry;
    result.entry.settings = entry.settings_for(*scene_);
    result.files = output_ / entry.name;
    clear(result.files);
    read_goldens([&] { load_goldens(context); });
    check_poses(context);
    if (!entry.images.empty()) check_images(context);
    decide(context);
    write_motion_page(context);
    const bool has_nothing_to_approve =
        result.verdict == Verdict::pass && (is_up_to_date(context) || !draws_its_goldens(context));
    if (!has_nothing_to_approve) result.refusal = prepare_approval(context);
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return std::move(result);
  } catch (const std::bad_alloc&) {
    return failed_case(output_, entry, "not enough memory to check the case");
  } catch (const fs::filesystem_error& error) {
    return failed_case(output_, entry, fmt::format("{}: {}", error.path1().string(), error.code().message()));
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
  result.refusal = "the case could not be checked";
  return result;
}

}  // namespace substep::golden
