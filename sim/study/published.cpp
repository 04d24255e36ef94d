#include "sim/study/published.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/toml_values.h"
#include "sim/math/floating_point.h"
#include "sim/measure/stepper.h"
#include "sim/model/settings_fields.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::array shown{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a5};

class PublishedReader : private TomlValues {
 public:
  explicit PublishedReader(const fs::path& file) : TomlValues(file) {}

  std::vector<PublishedResult> read() const {
    const toml::table root = parse();
    expect_keys(root, "the file of published results", {"result"});
    const toml::node* const list = root.get("result");
    if (list == nullptr || !list->is_array_of_tables()) throw Error("{}: has no [[result]]", file().string());
    std::vector<PublishedResult> results;
    for (const toml::node& node : *list->as_array()) results.push_back(result_in(*node.as_table()));
    return results;
  }

 private:
  const toml::node& required(const toml::table& table, std::string_view key) const {
    const toml::node* const node = table.get(key);
    if (node == nullptr) fail(table, fmt::format("'{}' is missing", key));
    return *node;
  }

  std::vector<Algorithm> shown_algorithms(const toml::table& table, std::string_view key) const {
    const toml::node* const node = table.get(key);
    if (node == nullptr) return {};
    std::vector<Algorithm> result = algorithms(*node, key);
    for (const Algorithm algorithm : result) {
      if (std::ranges::find(shown, algorithm) == shown.end())
        fail(*node, fmt::format("'{}' must be a1, a2, a3 or a5", key));
    }
    return result;
  }

  PublishedRun run_in(const toml::table& table, const PublishedResult& result) const {
    expect_keys(table, "[[result.run]]",
                {"name", "algorithms", "judged", "settings", "steps", "duration", "against", "at_least",
                 "time", "forget_patches", "quick"});
    PublishedRun run;
    run.name = text(required(table, "name"), "name");
    run.algorithms = shown_algorithms(table, "algorithms");
    if (run.algorithms.empty()) run.algorithms.assign(shown.begin(), shown.end());
    run.judged = shown_algorithms(table, "judged");
    for (const Algorithm judged : run.judged) {
      if (std::ranges::find(run.algorithms, judged) == run.algorithms.end())
        fail(*table.get("judged"), fmt::format("'judged' names {}, which is not run", title_of(judged)));
    }
    Settings given;
    std::vector<const SettingsField*> fields;
    if (const auto* node = table.get("settings")) {
      for (const auto& [key, value] : table_in(*node, "settings")) {
        const auto field = std::ranges::find(settings_fields, key.str(), &SettingsField::name);
        if (field == settings_fields.end()) fail(value, fmt::format("there is no setting '{}'", key.str()));
        set_field(given, *field, value);
        fields.push_back(&*field);
      }
    }
    const bool has_substeps = std::ranges::find(fields, "substeps", &SettingsField::name) != fields.end();
    run.adjust = [given, fields, has_substeps](Settings& settings) {
      for (const SettingsField* const field : fields) copy(settings, *field, given);
      // A2 gets as many row solves as the others.
      if (settings.algorithm == Algorithm::a2 && has_substeps)
        settings.iterations = iterations_at_equal_rows(given.substeps, given.iterations);
    };
    if (const auto* node = table.get("steps")) run.steps = integer(*node, "steps", 1, 1000);
    if (const auto* node = table.get("duration")) run.duration = positive(*node, "duration");
    if (const auto* node = table.get("against")) {
      run.against = text(*node, "against");
      const bool is_known = std::ranges::any_of(
          result.runs, [&](const PublishedRun& earlier) { return earlier.name == run.against; });
      if (!is_known) fail(*node, fmt::format("'against' names no earlier run of '{}'", result.name));
      run.at_least = positive(required(table, "at_least"), "at_least");
    } else if (const auto* alone = table.get("at_least")) {
      fail(*alone, "'at_least' needs 'against'");
    }
    for (const auto& [key, value] : {std::pair("time", &run.time), std::pair("quick", &run.quick),
                                     std::pair("forget_patches", &run.forget_patches)}) {
      if (const auto* const node = table.get(key)) *value = flag(*node, key);
    }
    return run;
  }

  PublishedResult result_in(const toml::table& table) const {
    expect_keys(table, "[[result]]", {"name", "scenes", "rule", "reported", "run"});
    PublishedResult result;
    result.name = text(required(table, "name"), "name");
    result.rule = text(required(table, "rule"), "rule");
    for (const toml::node& item : array(required(table, "scenes"), "scenes"))
      result.scenes.push_back(file().parent_path() / text(item, "scenes"));
    for (const toml::node& row : array(required(table, "reported"), "reported")) {
      result.reported.emplace_back();
      for (const toml::node& cell : array(row, "reported"))
        result.reported.back().push_back(text(cell, "reported"));
      if (result.reported.back().size() != 3) fail(row, "'reported' has engine, setting and result");
    }
    const toml::node& runs = required(table, "run");
    if (!runs.is_array_of_tables()) fail(runs, "'run' must be tables: [[result.run]]");
    for (const toml::node& run : *runs.as_array()) result.runs.push_back(run_in(*run.as_table(), result));
    return result;
  }
};

/// One run of one scene by one algorithm.
struct Job {
  const PublishedResult* result;
  const PublishedRun* run;
  const Scene* scene;
  Algorithm algorithm;
  std::vector<ExpectedFigure> figures = {};
  double milliseconds = 0;  ///< CPU time of a step
};

/// Shortens the scene, and the times for which expectations require rest.
void shorten(Scene& scene, double duration) {
  scene.duration = std::min(scene.duration, duration);
  for (Expectation& expected : scene.expected) {
    if (expected.reading != Reading::stays || expected.bound != Bound::at_least) continue;
    expected.value = std::min(expected.value, scene.duration);
    expected.needs = std::min(expected.needs, scene.duration);
  }
}

/// Runs a job, and sets its figures and CPU time.
void perform(Job& job, const std::stop_token& stop) {
  const DefaultFloatingPoint environment;
  const PublishedRun& run = *job.run;
  Scene scene = *job.scene;
  if (run.duration) shorten(scene, *run.duration);
  Settings settings = usual_settings(scene, job.algorithm);
  run.adjust(settings);
  settings.step *= run.steps;
  check(settings);
  Simulation simulation(scene, settings);
  ExpectationMeter meter(scene, simulation.state());
  const auto steps = std::llround(scene.duration / settings.step);
  bool diverged = false;
  for (std::int64_t step = 1; step <= steps && !diverged && !stop.stop_requested(); ++step) {
    if (run.forget_patches && !simulation.state().patches.empty()) {
      State state = simulation.state();
      state.patches.clear();
      simulation.set_state(state);
    }
    const double begin = cpu_time();
    diverged = simulation.step().status == StepReport::Status::diverged;
    job.milliseconds += 1e3 * (cpu_time() - begin);
    if (diverged) break;
    const auto contacts =
        meter.needs_contacts() ? simulation.contact_impulses() : std::vector<ContactImpulse>{};
    meter.add(simulation.state(), static_cast<double>(step) * settings.step, &contacts);
  }
  job.figures = meter.figures(diverged);
  job.milliseconds /= static_cast<double>(std::max<std::int64_t>(simulation.steps(), 1));
}

/// Returns the ratio of an earlier run's figure to the job's, which should be at least the run's `at_least`.
ExpectedFigure ratio_of(const Job& job, const std::string& what, const ExpectedFigure& figure,
                        const std::vector<PublishedFigure>& figures) {
  const auto earlier = std::ranges::find_if(figures, [&](const PublishedFigure& line) {
    return line.what == what && line.run == job.run->against && line.measured.contains(job.algorithm);
  });
  if (earlier == figures.end()) {
    throw Error("{}: run '{}' measures no {} of {} to compare run '{}' with", job.result->name,
                job.run->against, what, title_of(job.algorithm), job.run->name);
  }
  const double ratio = earlier->measured.at(job.algorithm).measured / figure.measured;
  return {figure.name, "", Bound::at_least, job.run->at_least, 1e-9, ratio};
}

/// Adds the figures of a job to the lines of its run and scene, which begin at `first`: one line for each
/// figure, and one for the CPU time where the run measures it.
void add_figures(const Job& job, std::size_t first, std::vector<PublishedFigure>& figures) {
  const PublishedRun& run = *job.run;
  figures.resize(first + job.figures.size() + (run.time ? 1 : 0));
  for (std::size_t i = 0; i < job.figures.size(); ++i) {
    ExpectedFigure figure = job.figures[i];
    PublishedFigure& line = figures[first + i];
    line.what = fmt::format("{}: {}", job.scene->name, figure.name);
    line.run = run.name;
    if (!run.against.empty()) {
      figure = ratio_of(job, line.what, figure, figures);
      line.run = fmt::format("{} over {}", run.against, run.name);
    }
    line.measured[job.algorithm] = figure;
    if (figure.is_bad() && std::ranges::find(run.judged, job.algorithm) != run.judged.end())
      line.missed_by.push_back(job.algorithm);
  }
  if (!run.time) return;
  PublishedFigure& line = figures.back();
  line.what = job.scene->name + ": CPU time of a step";
  line.run = run.name;
  line.is_time = true;
  line.measured[job.algorithm] = {"", "ms", Bound::equal, 0, 0, job.milliseconds};
}

/// Returns a rank: infinite for times, above 1e6 where a judged algorithm misses, else error over tolerance.
double rank_of(const PublishedFigure& line) {
  constexpr double above_all_errors = 1e6;
  if (line.is_time) return infinity;
  double worst = 0;
  for (const auto& [algorithm, figure] : line.measured)
    worst = std::max(worst, figure.error() / figure.tolerance);
  return line.missed_by.empty() ? worst : above_all_errors + worst;
}

/// Returns a table with a column for each figure, at most the four of highest rank, and a row for each run's
/// algorithm.
TextTable figures_table(const PublishedMeasurement& measurement) {
  constexpr std::size_t most = 4;
  TextTable table{{""}, {{"expected"}}};
  std::vector<double> ranks{0};  // by column; the first column, with titles, always stays
  for (const PublishedFigure& line : measurement.figures) {
    const ExpectedFigure& first = line.measured.begin()->second;
    const std::string name = line.what + (first.unit.empty() ? "" : ", ") + first.unit;
    const std::string expected = line.is_time ? "" : bounded_text(first.bound, short_number(first.expected));
    std::size_t column = 1;
    while (column < ranks.size() && (table.head[column] != name || table.rows[0][column] != expected))
      ++column;
    if (column == ranks.size()) {
      table.head.push_back(name);
      table.rows[0].push_back(expected);
      ranks.push_back(0);
    }
    ranks[column] = std::max(ranks[column], rank_of(line));
    for (const Algorithm algorithm : shown) {
      const auto found = line.measured.find(algorithm);
      if (found == line.measured.end()) continue;
      const std::string title = fmt::format("{}: {}", line.run, title_of(algorithm));
      auto row = std::ranges::find(
          table.rows, title, [](const auto& cells) -> const auto& { return cells[0]; });
      if (row == table.rows.end()) row = table.rows.insert(row, {title});
      row->resize(std::max(row->size(), column + 1));
      const ExpectedFigure& figure = found->second;
      (*row)[column] = line.is_time ? fmt::format("~{:.2g}", figure.measured)
                                    : short_number(figure.measured) + (figure.is_bad() ? "!" : "");
    }
  }
  for (std::vector<std::string>& row : table.rows) row.resize(ranks.size());
  while (ranks.size() > most + 1) {
    const auto least = std::min_element(ranks.begin() + 1, ranks.end()) - ranks.begin();
    table.head.erase(table.head.begin() + least);
    for (std::vector<std::string>& row : table.rows) row.erase(row.begin() + least);
    ranks.erase(ranks.begin() + least);
  }
  return table;
}

}  // namespace

std::vector<PublishedResult> read_published(const fs::path& file) {
  return PublishedReader(file).read();
}

bool PublishedMeasurement::is_met() const {
  return std::ranges::all_of(figures, [](const PublishedFigure& line) { return line.missed_by.empty(); });
}

std::vector<PublishedMeasurement> measure_published(const std::vector<PublishedResult>& results,
                                                    const PublishedOptions& options) {
  std::vector<Job> jobs;
  std::vector<std::vector<Scene>> scenes(results.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    const PublishedResult& result = results[i];
    if (result.name.find(options.only) == std::string::npos) continue;
    for (const fs::path& file : result.scenes) scenes[i].push_back(load_scene(file));
    for (const PublishedRun& run : result.runs) {
      if (options.quick && !run.quick) continue;
      for (const Scene& scene : scenes[i]) {
        for (const Algorithm algorithm : run.algorithms) jobs.push_back({&result, &run, &scene, algorithm});
      }
    }
  }
  std::atomic<std::size_t> done = 0;
  parallel_for(
      options.threads, jobs.size(),
      [&](std::size_t i, const std::stop_token& stop) {
        perform(jobs[i], stop);
        ++done;
      },
      [&] {
        if (options.progress)
          options.progress(static_cast<double>(done.load()) / static_cast<double>(jobs.size()));
      });
  std::vector<PublishedMeasurement> measurements;
  std::size_t first = 0;
  for (const Job* before = nullptr; const Job& job : jobs) {
    if (!before || before->result != job.result) measurements.push_back({*job.result, {}});
    std::vector<PublishedFigure>& figures = measurements.back().figures;
    if (!before || before->run != job.run || before->scene != job.scene) first = figures.size();
    if (job.figures.empty() && !job.run->time)
      throw Error("{}: run '{}' measures nothing of {}", job.result->name, job.run->name, job.scene->name);
    add_figures(job, first, figures);
    before = &job;
  }
  std::ranges::stable_sort(measurements, {}, [](const PublishedMeasurement& m) { return m.is_met(); });
  return measurements;
}

std::string to_markdown(const std::vector<PublishedMeasurement>& measurements) {
  std::string text;
  for (const PublishedMeasurement& measurement : measurements) {
    std::vector<std::string> missed;
    for (const PublishedFigure& line : measurement.figures) {
      for (const Algorithm algorithm : line.missed_by) {
        const std::string entry = fmt::format("{}, {}", title_of(algorithm), line.run);
        if (std::ranges::find(missed, entry) == missed.end()) missed.push_back(entry);
      }
    }
    text += fmt::format("### {}\nRule: {}. **{}.** Reported:\n\n", measurement.result.name,
                        measurement.result.rule,
                        missed.empty() ? "Met" : fmt::format("Lost by {}", fmt::join(missed, "; ")));
    for (const std::vector<std::string>& row : measurement.result.reported)
      text += fmt::format("- {}, {}: {}\n", row[0], row[1], row[2]);
    text += fmt::format("\n{}\n", to_markdown(figures_table(measurement)));
  }
  return text +
         "At most four figures of a result are shown, those missed most. !: beyond the scene's tolerance.\n";
}

}  // namespace substep
