#include "sim/study/published.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

#include "sim/error.h"
#include "sim/execution/parallel_for.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/toml_values.h"
#include "sim/math/floating_point.h"
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
    if (list == nullptr || !list->is_array_of_tables())
      throw Error(fmt::format("{}: has no [[result]]", file().string()));
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
    const bool has_iterations = std::ranges::find(fields, "iterations", &SettingsField::name) != fields.end();
    run.adjust = [given, fields, has_substeps, has_iterations](Settings& settings) {
      for (const SettingsField* const field : fields) copy(settings, *field, given);
      // A2 gets as many row solves as the others.
      if (settings.algorithm == Algorithm::a2 && has_substeps)
        settings.iterations = given.substeps * (has_iterations ? given.iterations : 1);
    };
    if (const auto* node = table.get("steps")) run.steps = integer(*node, "steps", 1, 1000);
    if (const auto* node = table.get("duration")) run.duration = positive(*node, "duration");
    if (const auto* node = table.get("against")) {
      run.against = text(*node, "against");
      const bool is_known = std::ranges::any_of(
          result.runs, [&](const PublishedRun& earlier) { return earlier.name == run.against; });
      if (!is_known) fail(*node, fmt::format("'against' names no earlier run of '{}'", result.name));
      run.at_least = positive(required(table, "at_least"), "at_least");
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
  std::size_t result;
  std::size_t run;
  std::size_t scene;
  Algorithm algorithm;
  std::vector<ExpectedFigure> figures = {};
  double milliseconds = 0;  ///< CPU time of a step
};

double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Shortens the scene, and times for which it is expected to stay at rest.
void shorten(Scene& scene, double duration) {
  scene.duration = std::min(scene.duration, duration);
  for (Expectation& expected : scene.expected) {
    if (expected.reading != Reading::stays || expected.bound != Bound::at_least) continue;
    expected.value = std::min(expected.value, scene.duration);
    expected.needs = std::min(expected.needs, scene.duration);
  }
}

void perform(Job& job, Scene scene, const PublishedRun& run, const std::stop_token& stop) {
  const DefaultFloatingPoint environment;
  if (run.duration) shorten(scene, *run.duration);
  Settings settings = usual_settings(scene, job.algorithm);
  settings.step *= run.steps;
  run.adjust(settings);
  check(settings);
  Simulation simulation(scene, settings);
  ExpectationMeter meter(scene, simulation.state());
  const auto steps = std::llround(scene.duration / settings.step);
  const double begin = thread_seconds();
  bool diverged = false;
  for (std::int64_t step = 1; step <= steps && !diverged && !stop.stop_requested(); ++step) {
    if (run.forget_patches && !simulation.state().patches.empty()) {
      State state = simulation.state();
      state.patches.clear();
      simulation.set_state(state);
    }
    diverged = simulation.step().status == StepReport::Status::diverged;
    if (diverged) break;
    const bool needs_contacts = meter.needs_contacts();
    const auto contacts = needs_contacts ? simulation.contact_impulses() : std::vector<ContactImpulse>{};
    meter.add(simulation.state(), static_cast<double>(step) * settings.step, &contacts);
  }
  job.figures = meter.figures(diverged);
  job.milliseconds =
      1e3 * (thread_seconds() - begin) / static_cast<double>(std::max<std::int64_t>(simulation.steps(), 1));
}

/// Adds the figures of one run's jobs: a line for each figure of each scene.
void add_figures(const std::vector<Job>& jobs, std::size_t number, std::size_t run_number,
                 const std::vector<Scene>& scenes, PublishedMeasurement& measurement) {
  const PublishedRun& run = measurement.result.runs[run_number];
  for (std::size_t scene = 0; scene < scenes.size(); ++scene) {
    std::vector<PublishedFigure> lines;
    PublishedFigure time{scenes[scene].name + ": CPU time of a step", run.name, {}, true, {}};
    for (const Job& job : jobs) {
      if (job.result != number || job.run != run_number || job.scene != scene) continue;
      lines.resize(job.figures.size());
      for (std::size_t i = 0; i < lines.size(); ++i) {
        ExpectedFigure figure = job.figures[i];
        lines[i].what = fmt::format("{}: {}", scenes[scene].name, figure.name);
        lines[i].run = run.name;
        if (!run.against.empty()) {
          const auto earlier = std::ranges::find_if(measurement.figures, [&](const PublishedFigure& line) {
            return line.what == lines[i].what && line.run == run.against &&
                   line.measured.contains(job.algorithm);
          });
          if (earlier == measurement.figures.end()) {
            throw Error(fmt::format("{}: run '{}' measures no {} of {} to compare run '{}' with",
                                    measurement.result.name, run.against, lines[i].what,
                                    title_of(job.algorithm), run.name));
          }
          figure.measured = earlier->measured.at(job.algorithm).measured / figure.measured;
          figure.expected = run.at_least;
          figure.bound = Bound::at_least;
          figure.tolerance = 1e-9;
          figure.unit = "";
          lines[i].run = fmt::format("{} over {}", run.against, run.name);
        }
        lines[i].measured[job.algorithm] = figure;
        if (figure.is_bad() && std::ranges::find(run.judged, job.algorithm) != run.judged.end())
          lines[i].missed_by.push_back(job.algorithm);
      }
      time.measured[job.algorithm] = {"", "ms", Bound::equal, 0, 0, job.milliseconds};
    }
    measurement.figures.insert(measurement.figures.end(), lines.begin(), lines.end());
    if (run.time && !time.measured.empty()) measurement.figures.push_back(time);
  }
}

std::string expected_text(const ExpectedFigure& figure) {
  const char* const sign = figure.bound == Bound::at_most    ? "≤ "
                           : figure.bound == Bound::at_least ? "≥ "
                                                             : "";
  return sign + short_number(figure.expected);
}

std::string cell_text(const ExpectedFigure& figure, bool is_time) {
  if (is_time) return fmt::format("~{:.2g}", figure.measured);
  return short_number(figure.measured) + (figure.is_bad() ? "!" : "");
}

/// Returns a rank: times first, then figures that lose the result, then the largest error relative to the
/// tolerance.
double rank_of(const PublishedFigure& line) {
  constexpr double above_all_errors = 1e6;
  if (line.is_time) return infinity;
  double worst = 0;
  for (const auto& [algorithm, figure] : line.measured)
    worst = std::max(worst, figure.error() / figure.tolerance);
  return line.missed_by.empty() ? worst : above_all_errors + worst;
}

/// Returns a table with a row for each figure, at most the four of highest rank, and a column for each run's
/// algorithm.
TextTable figures_table(const PublishedMeasurement& measurement) {
  constexpr std::size_t most = 4;
  TextTable table{{"figure", "expected"}, {}};
  std::vector<double> ranks;
  const auto index_of = [](std::vector<std::string>& names, const std::string& name) {
    const auto found = std::ranges::find(names, name);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    names.push_back(name);
    return names.size() - 1;
  };
  for (const PublishedFigure& line : measurement.figures) {
    const ExpectedFigure& first = line.measured.begin()->second;
    const std::string name = line.what + (first.unit.empty() ? "" : ", ") + first.unit;
    const std::string expected = line.is_time ? "" : expected_text(first);
    auto row = std::ranges::find_if(
        table.rows, [&](const auto& earlier) { return earlier[0] == name && earlier[1] == expected; });
    if (row == table.rows.end()) {
      row = table.rows.insert(row, {name, expected});
      ranks.push_back(0);
    }
    double& rank = ranks[static_cast<std::size_t>(row - table.rows.begin())];
    rank = std::max(rank, rank_of(line));
    for (const Algorithm algorithm : shown) {
      const auto found = line.measured.find(algorithm);
      if (found == line.measured.end()) continue;
      const std::size_t column = index_of(table.head, fmt::format("{}: {}", line.run, title_of(algorithm)));
      row->resize(std::max(row->size(), column + 1));
      (*row)[column] = cell_text(found->second, line.is_time);
    }
  }
  for (std::vector<std::string>& row : table.rows) row.resize(table.head.size());
  while (table.rows.size() > most) {
    const auto least = std::ranges::min_element(ranks) - ranks.begin();
    table.rows.erase(table.rows.begin() + least);
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
  for (std::size_t r = 0; r < results.size(); ++r) {
    const PublishedResult& result = results[r];
    if (result.name.find(options.only) == std::string::npos) continue;
    for (const fs::path& file : result.scenes) scenes[r].push_back(load_scene(file));
    for (std::size_t k = 0; k < result.runs.size(); ++k) {
      if (options.quick && !result.runs[k].quick) continue;
      for (std::size_t s = 0; s < result.scenes.size(); ++s) {
        for (const Algorithm algorithm : result.runs[k].algorithms) jobs.push_back({r, k, s, algorithm});
      }
    }
  }
  std::atomic<std::size_t> done = 0;
  parallel_for(
      options.threads, jobs.size(),
      [&](std::size_t i, const std::stop_token& stop) {
        Job& job = jobs[i];
        perform(job, scenes[job.result][job.scene], results[job.result].runs[job.run], stop);
        ++done;
      },
      [&] {
        if (options.progress)
          options.progress(static_cast<double>(done.load()) / static_cast<double>(jobs.size()));
      });
  std::vector<PublishedMeasurement> measurements;
  for (std::size_t r = 0; r < results.size(); ++r) {
    PublishedMeasurement measurement{results[r], {}};
    for (std::size_t k = 0; k < results[r].runs.size(); ++k) add_figures(jobs, r, k, scenes[r], measurement);
    if (!measurement.figures.empty()) measurements.push_back(std::move(measurement));
  }
  std::ranges::stable_sort(measurements, {}, [](const PublishedMeasurement& m) { return m.is_met(); });
  return measurements;
}

std::string to_markdown(const std::vector<PublishedMeasurement>& measurements) {
  std::string text;
  for (const PublishedMeasurement& measurement : measurements) {
    std::vector<std::string> lost;
    for (const PublishedFigure& line : measurement.figures) {
      for (const Algorithm algorithm : line.missed_by) {
        const std::string entry = fmt::format("{}, {}", title_of(algorithm), line.run);
        if (std::ranges::find(lost, entry) == lost.end()) lost.push_back(entry);
      }
    }
    text += fmt::format("### {}\nRule: {}. **{}.** Reported:\n\n", measurement.result.name,
                        measurement.result.rule,
                        lost.empty() ? "Met" : fmt::format("Lost by {}", fmt::join(lost, "; ")));
    for (const std::vector<std::string>& row : measurement.result.reported)
      text += fmt::format("- {}, {}: {}\n", row[0], row[1], row[2]);
    text += fmt::format("\n{}\n", to_markdown(figures_table(measurement)));
  }
  return text +
         "At most four figures of a result are shown, those missed most. !: beyond the scene's tolerance.\n";
}

}  // namespace substep
