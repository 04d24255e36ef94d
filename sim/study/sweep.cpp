#include "sim/study/sweep.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/loading/json_value.h"
#include "sim/log/file_output.h"
#include "sim/math/fnv1a.h"
#include "sim/measure/substep_map.h"
#include "sim/model/model.h"
#include "sim/study/engines/engines.h"
#include "sim/study/sweep_results.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// Returns a hash of the inputs of a job's result, without the job's key.
std::string fingerprint(const Sweep& sweep, const SweepJob& job) {
  const Scene& scene = sweep.scenes.at(job.scene);
  const std::string text = fmt::format("{:x} {:x} {} {} {} {} {}", program_hash().value_or(0), scene.hash,
                                       sweep.horizon_of(job.scene), scene.duration, sweep.repetitions,
                                       sweep.most, sweep.splits_errors);
  return fmt::format("{:016x}", fnv1a(text));
}

fs::path file_of(const fs::path& results, const SweepJob& job) {
  return results / "jobs" / (job.key + ".json");
}

/// Returns the first line of a job's file: hashes of what the result was made from, and of the result.
std::string seal(const Sweep& sweep, const SweepJob& job, std::string_view record) {
  return fmt::format("{} {:016x}", fingerprint(sweep, job), fnv1a(record));
}

struct FoundJob {
  std::optional<std::string> record = {};  ///< nothing without a file of this build, scene and sweep file
  bool is_damaged = false;                 ///< the first line is no seal, or does not match the record
};

/// Reads a job's file: a line with the seal, then the record.
FoundJob found_job(const Sweep& sweep, const fs::path& results, const SweepJob& job) {
  constexpr std::size_t digits = 16;
  const fs::path file = file_of(results, job);
  if (!fs::exists(file)) return {};
  if (!fs::is_regular_file(file))
    throw Error("{}: is not a file: remove it, to make room for a job's result", file.string());
  const std::string text = content_of(file).value_or("");
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = std::string_view(text).substr(0, end);
  const bool is_seal = line.size() == 2 * digits + 1 && line[digits] == ' ' && end < text.size();
  if (!is_seal) return {.is_damaged = true};
  if (line.substr(0, digits) != fingerprint(sweep, job)) return {};
  std::string record = text.substr(end + 1);
  if (line != seal(sweep, job, record)) return {.is_damaged = true};
  return {std::move(record)};
}

void measure_engine(const Sweep& sweep, const Scene& scene, const ReferenceMotion& reference,
                    SweepRecord& record) {
  const Engine* const engine = find_engine(record.engine);
  record.label =
      fmt::format("{}{}  h={:g}", engine ? engine->label : record.engine,
                  engine && engine->has_iterations ? fmt::format("  m={}", record.settings.iterations) : "",
                  record.settings.step);
  if (!engine) {
    record.omitted = fmt::format("no such engine is built in; there are {}", engine_names());
    return;
  }
  try {
    const auto stepper = engine->make(scene, record.settings);
    record.metrics = measure(scene, *stepper, record.settings.step, reference);
    if (sweep.repetitions > 0 && !engine->is_command)
      record.times = time_run(scene, record.settings, engine->make, sweep.repetitions);
  } catch (const Error& error) {
    record.omitted = error.what();
  }
}

SweepRecord measured(const Sweep& sweep, const SweepJob& job, const ReferenceMotion& reference) {
  const Scene& scene = sweep.scenes.at(job.scene);
  SweepRecord record;
  static_cast<SweepJob&>(record) = job;
  record.label = label(job.settings);
  record.contacts = contact_kind(scene, reference);
  record.size = size_of(scene);
  record.duration = scene.duration;
  record.reference = reference.method;
  record.uncertainty = reference.uncertainty().position;
  record.turn_uncertainty = reference.uncertainty().turn;
  record.horizon = reference.horizon;
  record.divergence_point = reference.divergence_point;
  if (!job.engine.empty()) {
    measure_engine(sweep, scene, reference, record);
    return record;
  }
  record.substep_radius = substep_radius(scene, job.settings);
  if (job.is_limit) {
    record.limit = stability_limit(scene, job.settings, reference, sweep.most);
  } else {
    record.metrics = measure(scene, job.settings, reference, sweep.splits_errors);
    if (sweep.repetitions > 0) {
      record.times = sweep.splits_errors
                         ? time_run(scene, job.settings, sweep.repetitions)
                         : time_run(scene, job.settings, algorithm_stepper, sweep.repetitions);
    }
  }
  return record;
}

/// Returns a rough estimate of a job's work: to show the time that is left, and to start long jobs first.
double estimated_work(const Sweep& sweep, const SweepJob& job) {
  const Scene& scene = sweep.scenes.at(job.scene);
  const double size = static_cast<double>(scene.bodies.size() + 8 * scene.colliders.size());
  const Settings& s = job.settings;
  const double steps = scene.duration / s.step;
  const double work = 10 + s.substeps * (s.iterations + 4.0);
  return size * steps * work * (job.is_limit ? 12 : 3 + sweep.repetitions);
}

}  // namespace

ContactKind contact_kind(const Scene& scene, const ReferenceMotion& reference) {
  if (!build_model(scene).contacts) return ContactKind::none;
  return stands(scene, reference) ? ContactKind::standing : ContactKind::moving;
}

int run_sweep(const Sweep& sweep, const SweepOptions& options, const std::function<void(double)>& progress) {
  std::error_code failure;
  fs::create_directories(options.results / "jobs", failure);
  if (failure) throw Error("{}: cannot be made: {}", options.results.string(), failure.message());
  for (const char* const name : {"sweep.json", "errors.csv", "times.csv"})
    fs::remove(options.results / name, failure);
  std::vector<const SweepJob*> open;
  for (std::size_t i = 0; i < sweep.jobs.size(); ++i) {
    if (static_cast<int>(i % options.parts) != options.part - 1) continue;
    const std::optional<std::string> record = found_job(sweep, options.results, sweep.jobs[i]).record;
    // Try an omitted run again: its engine may be installed by now.
    if (!record || !record_in(*record).omitted.empty()) open.push_back(&sweep.jobs[i]);
  }
  // Start the longest jobs first. The order does not change the results.
  const auto cost = [&](const SweepJob* job) { return estimated_work(sweep, *job); };
  std::ranges::stable_sort(open, std::ranges::greater(), cost);
  const int threads = options.threads > 0
                          ? options.threads
                          : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));

  std::map<std::string, ReferenceMotion> references;
  for (const SweepJob* job : open) references.try_emplace(job->scene);
  std::vector<std::string> names;
  for (const auto& [name, reference] : references) names.push_back(name);
  double total = 0;
  for (const SweepJob* job : open) total += cost(job);
  // References are about a tenth of the work.
  const double reference_cost = names.empty() ? 0 : 0.1 * total / static_cast<double>(names.size());
  total *= 1.1;
  std::atomic<double> done{0};
  const auto report = [&] {
    if (progress && total > 0) progress(done / total);
  };
  parallel_for(
      threads, names.size(),
      [&](std::size_t i, const std::stop_token& /*stop*/) {
        const std::string& name = names[i];
        references.at(name) =
            reference_motion(sweep.scenes.at(name), sweep.horizon_of(name), 1, options.cache);
        done += reference_cost;
      },
      report);
  parallel_for(
      threads, open.size(),
      [&](std::size_t i, const std::stop_token& /*stop*/) {
        const SweepJob& job = *open[i];
        const SweepRecord record = measured(sweep, job, references.at(job.scene));
        const std::string text = to_json(record) + "\n";
        write_file(file_of(options.results, job), fmt::format("{}\n{}", seal(sweep, job, text), text));
        done += cost(&job);
      },
      report);
  return static_cast<int>(open.size());
}

std::vector<fs::path> damaged_jobs(const Sweep& sweep, const fs::path& results) {
  std::vector<fs::path> damaged;
  for (const SweepJob& job : sweep.jobs) {
    if (found_job(sweep, results, job).is_damaged) damaged.push_back(file_of(results, job));
  }
  return damaged;
}

std::vector<SweepRecord> merge_sweep(const Sweep& sweep, const fs::path& results) {
  std::vector<std::string> missing;
  std::vector<std::string> texts;
  std::vector<SweepRecord> records;
  for (const SweepJob& job : sweep.jobs) {
    const std::optional<std::string> record = found_job(sweep, results, job).record;
    if (record) {
      records.push_back(record_in(*record));
      texts.push_back(record->substr(0, record->size() - 1));
    } else {
      missing.push_back(job.key);
    }
  }
  if (!missing.empty()) {
    const std::vector<fs::path> damaged = damaged_jobs(sweep, results);
    throw Error(
        "{}: {} of {} jobs are not done, the first is {}{}: run the sweep again, which keeps finished jobs",
        results.string(), missing.size(), sweep.jobs.size(), missing.front(),
        damaged.empty() ? "" : fmt::format(" ({} is damaged)", damaged.front().string()));
  }
  write_file(results / "sweep.json", fmt::format("[\n{}\n]\n", fmt::join(texts, ",\n")));
  write_file(results / "errors.csv", errors_csv(records));
  write_file(results / "times.csv", times_csv(records));
  mark_turns(records);
  return records;
}

std::vector<SweepRecord> read_records(const fs::path& results) {
  const fs::path file = results / "sweep.json";
  const auto text = content_of(file);
  if (!text) throw Error("{}: cannot be read: 'substep sweep' writes it", file.string());
  std::vector<SweepRecord> records;
  try {
    for (const auto& entry : parse_json(*text, file.string())) {
      records.push_back(record_in(entry.dump()));
    }
  } catch (const std::exception& error) {
    throw Error("{}: {}", file.string(), error.what());
  }
  mark_turns(records);
  return records;
}

}  // namespace substep
