#include "sim/study/sweep.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/toml_values.h"
#include "sim/model/settings_fields.h"
#include "sim/model/usual_settings.h"
#include "sim/study/engines/engines.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// Returns the settings, with fixed values of those that the algorithm does not read, for equal records.
Settings as_read(Settings settings) {
  constexpr Settings unread{.substeps = 1, .joints = Joints::rows};
  for (const SettingsField& field : settings_fields) {
    if (!field.is_read_by(settings.algorithm)) copy(settings, field, unread);
  }
  return settings;
}

/// Returns true where a grid, or the table of a limit, lists values of the field under its name. Three have
/// none: the algorithm has another name, the step is divided, and a limit varies the sub-steps.
bool has_list(const SettingsField& field, bool is_limit) {
  return field.name != "algorithm" && field.name != "step" && !(is_limit && field.name == "substeps");
}

std::string key_of(const SweepJob& job) {
  const Settings& s = job.settings;
  if (!job.engine.empty())
    return fmt::format("{}.{}-h{}-m{}", job.scene, job.engine, job.divisions, s.iterations);
  std::string text = fmt::format("{}.{}", job.scene, name(s.algorithm));
  text += job.is_limit ? "-limit" : fmt::format("-h{}", job.divisions);
  for (const SettingsField& field : settings_fields) {
    if (!has_list(field, job.is_limit) || !field.is_read_by(s.algorithm)) continue;
    if (field.is_left_out(s)) continue;
    if (!field.overrides.empty() && text_of(s, field) == text_of(Settings{}, field)) continue;
    text += fmt::format("-{}{}", field.label.letter, text_of(s, field));
  }
  return text;
}

/// A field's list of values in a grid, each as a Settings that has it.
struct GridList {
  const SettingsField* field;
  std::vector<Settings> values;
};

/// Returns `start` with every combination of the lists' values; values of the last list vary fastest.
std::vector<Settings> combinations(const Settings& start, const std::vector<GridList>& lists) {
  std::vector<Settings> result{start};
  for (const GridList& list : lists) {
    std::vector<Settings> longer;
    for (const Settings& settings : result) {
      for (const Settings& value : list.values) {
        copy(longer.emplace_back(settings), *list.field, value);
      }
    }
    result = std::move(longer);
  }
  return result;
}

/// One table of the file.
struct Grid {
  std::vector<const Scene*> scenes;
  std::vector<int> divisions{1};
  std::vector<int> iterations;  ///< of algorithms and engines; empty: the defaults
  std::vector<Algorithm> algorithms;
  std::vector<std::string> engines;
  std::vector<GridList> lists;  ///< of the other fields
};

class Reader : private TomlValues {
 public:
  using TomlValues::TomlValues;

  Sweep read() {
    const toml::table root = parse();
    expect_keys(root, "the sweep file",
                {"horizon", "repetitions", "most", "properties", "parts", "horizons", "grid", "limit"});
    if (const auto* node = root.get("horizon")) sweep_.horizon = positive(*node, "horizon");
    if (const auto* node = root.get("repetitions"))
      sweep_.repetitions = integer(*node, "repetitions", 0, 1000);
    if (const auto* node = root.get("most")) sweep_.most = integer(*node, "most", 1, 4096);
    for (const auto& [key, value] :
         {std::pair("properties", &sweep_.properties), std::pair("parts", &sweep_.splits_errors)}) {
      if (const auto* const node = root.get(key)) *value = flag(*node, key);
    }
    for (const char* const kind : {"grid", "limit"}) {
      const toml::node* const list = root.get(kind);
      if (list == nullptr) continue;
      if (!list->is_array_of_tables()) fail(*list, fmt::format("'{0}' must be tables: [[{0}]]", kind));
      for (const toml::node& node : *list->as_array()) {
        read_grid(*node.as_table(), std::string_view(kind) == "limit");
      }
    }
    if (sweep_.jobs.empty()) throw Error("{}: has no [[grid]] or [[limit]] with a scene", file().string());
    if (const auto* node = root.get("horizons")) read_horizons(*node);
    return checked();
  }

  /// Returns the sweep of these scenes without reading the file.
  Sweep sweep_of(const std::vector<fs::path>& files, bool maps) {
    sweep_.repetitions = 3;
    sweep_.splits_errors = false;
    for (const fs::path& file : files) {
      Scene loaded = load_scene(file);
      const auto [entry, is_new] = sweep_.scenes.try_emplace(loaded.name, std::move(loaded));
      if (!is_new) throw Error("{}: another scene is named '{}'", file.string(), entry->first);
      const Scene* const scene = &entry->second;
      // Take an eighth, a quarter, … of the usual number.
      const auto eighths_of = [](int usual, int most) {
        std::vector<int> numbers;
        for (int eighths = 1; eighths <= most; eighths *= 2)
          numbers.push_back(std::max(1, usual * eighths / 8));
        return numbers;
      };
      const auto list_of = [](std::string_view name, const auto& values) {
        GridList list{&field_named(name), {}};
        for (const auto value : values)
          set(list.values.emplace_back(), *list.field, fmt::format("{}", value));
        return list;
      };
      const std::vector<Algorithm> mapped{Algorithm::a3, Algorithm::a5};
      const std::vector<Algorithm> substepping{Algorithm::a3, Algorithm::a4, Algorithm::a5};
      const std::vector<int> iterations = eighths_of(usual_settings(*scene, Algorithm::a2).iterations, 32);
      const std::vector<int> many = eighths_of(scene->substeps, 32);
      const std::vector<int> few = eighths_of(scene->substeps, 8);
      // Refine the step of A1, the iterations of A2 and the sub-steps of A3 to A5.
      add_grid({{scene}, {1, 2, 4, 8}, {}, {Algorithm::a1}, {}, {}}, false);
      add_grid({{scene}, {1}, iterations, {Algorithm::a2}, {}, {}}, false);
      add_grid({{scene}, {1}, {}, substepping, {}, {list_of("substeps", many)}}, false);
      if (!maps) continue;
      // Map steps by sub-steps, and τ by κ.
      add_grid({{scene}, {1, 2, 4, 8}, {}, mapped, {}, {list_of("substeps", few)}}, false);
      add_grid({{scene},
                {1},
                {},
                mapped,
                {},
                {list_of("tau", std::array{0.2, 0.6, 1.0, 1.4, 1.8}),
                 list_of("kappa", std::array{0.4, 0.7, 1.0, 1.3, 1.6})}},
               false);
    }
    return checked();
  }

 private:
  /// Returns the sweep with durations of whole steps. Throws Error where a scene or its horizon is too short.
  Sweep checked() {
    for (auto& [name, scene] : sweep_.scenes) {
      check_durations(scene, sweep_.horizon_of(name));
      // Keep the bits of a duration that has whole steps.
      const double whole = std::round(scene.duration / scene.step) * scene.step;
      if (std::abs(whole - scene.duration) > 1e-6 * scene.duration) scene.duration = whole;
    }
    return std::move(sweep_);
  }

  /// Returns the result of `action`. Its errors get the line of `node`.
  auto at(const toml::node& node, const auto& action) const {
    try {
      return action();
    } catch (const Error& error) {
      fail(node, error.what());
    }
  }

  void read_horizons(const toml::node& node) {
    for (const auto& [key, value] : table_in(node, "horizons")) {
      const std::string name(key.str());
      if (!sweep_.scenes.contains(name)) fail(value, fmt::format("no grid has a scene '{}'", name));
      sweep_.horizons[name] = positive(value, name);
    }
  }

  /// Returns the entries of a list of the table; none if it has no such list.
  std::vector<const toml::node*> list(const toml::table& table, std::string_view key) const {
    std::vector<const toml::node*> entries;
    if (const toml::node* const node = table.get(key)) {
      for (const toml::node& entry : array(*node, key)) entries.push_back(&entry);
    }
    return entries;
  }

  /// Returns the file that `node` names or, if the name has a "*", the matching files, sorted by name.
  std::vector<fs::path> files_of(const toml::node& node, std::string_view key) const {
    const fs::path path = (file().parent_path() / text(node, key)).lexically_normal();
    const std::string pattern = path.filename().string();
    if (pattern.find('*') == std::string::npos) return {path};
    std::vector<fs::path> files;
    std::error_code none;
    for (const auto& entry :
         fs::directory_iterator(path.has_parent_path() ? path.parent_path() : ".", none)) {
      if (fnmatch(pattern.c_str(), entry.path().filename().c_str(), 0) == 0)
        files.push_back(entry.path().lexically_normal());
    }
    if (files.empty()) fail(node, fmt::format("no file matches '{}'", path.string()));
    std::ranges::sort(files);
    return files;
  }

  const Scene& scene_of(const toml::node& node, const fs::path& file) {
    Scene scene = at(node, [&] { return load_scene(file); });
    const auto [entry, is_new] = sweep_.scenes.try_emplace(scene.name, std::move(scene));
    if (!is_new && entry->second.file != file) {
      fail(node, fmt::format("two scenes are named '{}'", entry->first));
    }
    return entry->second;
  }

  void add(SweepJob job) {
    job.key = key_of(job);
    if (keys_.insert(job.key).second) sweep_.jobs.push_back(std::move(job));
  }

  static std::vector<std::string_view> keys_of_grid(bool is_limit) {
    std::vector<std::string_view> keys{"scenes", "algorithms"};
    for (const SettingsField& field : settings_fields) {
      if (has_list(field, is_limit)) keys.push_back(field.name);
    }
    if (!is_limit) keys.insert(keys.end(), {"divisions", "engines"});
    return keys;
  }

  Grid grid_in(const toml::table& table, bool is_limit) {
    Grid grid;
    if (const auto* const node = table.get("algorithms")) grid.algorithms = algorithms(*node, "algorithms");
    for (const toml::node* const node : list(table, "engines")) {
      grid.engines.push_back(text(*node, "engines"));
      if (!is_engine_name(grid.engines.back()))
        fail(*node,
             fmt::format("there is no engine '{}'; there are {}", grid.engines.back(), engine_names()));
    }
    const auto divisions = list(table, "divisions");
    if (!divisions.empty()) grid.divisions.clear();
    for (const toml::node* const node : divisions)
      grid.divisions.push_back(integer(*node, "divisions", 1, 4096));
    for (const SettingsField& field : settings_fields) {
      if (!has_list(field, is_limit)) continue;
      GridList values{&field, {}};
      for (const toml::node* const node : list(table, field.name)) {
        Settings& one = values.values.emplace_back(default_settings(field.first));
        set_field(one, field, *node);
        at(*node, [&] { check(one); });
        if (field.name == "iterations") grid.iterations.push_back(one.iterations);
      }
      if (!values.values.empty() && field.name != "iterations") grid.lists.push_back(std::move(values));
    }
    const char* const kind = is_limit ? "limit" : "grid";
    if (table.get("scenes") == nullptr) fail(table, fmt::format("[[{}]] needs 'scenes'", kind));
    if (grid.algorithms.empty() && grid.engines.empty())
      fail(table, fmt::format("[[{}]] needs 'algorithms'{}", kind, is_limit ? "" : " or 'engines'"));
    for (const toml::node* const node : list(table, "scenes")) {
      for (const fs::path& file : files_of(*node, "scenes")) grid.scenes.push_back(&scene_of(*node, file));
    }
    return grid;
  }

  void read_grid(const toml::table& table, bool is_limit) {
    expect_keys(table, is_limit ? "[[limit]]" : "[[grid]]", keys_of_grid(is_limit));
    const Grid grid = grid_in(table, is_limit);
    for (const Scene* const scene : grid.scenes) {
      for (const int division : grid.divisions) at(table, [&] { check({.step = scene->step / division}); });
    }
    add_grid(grid, is_limit);
  }

  void add_grid(const Grid& grid, bool is_limit) {
    for (const Scene* const scene : grid.scenes) {
      for (const int division : grid.divisions) {
        const SweepJob job{{}, scene->name, {}, {.step = scene->step / division}, division, is_limit};
        if (grid.iterations.empty()) add_jobs(grid, *scene, job, std::nullopt);
        for (const int iterations : grid.iterations) add_jobs(grid, *scene, job, iterations);
      }
    }
  }

  /// Adds the engines and algorithms of a grid at the step of `job`. `iterations`: absent for their defaults.
  void add_jobs(const Grid& grid, const Scene& scene, const SweepJob& job, std::optional<int> iterations) {
    for (const std::string& engine : grid.engines) {
      SweepJob other = job;
      other.engine = engine;
      other.settings.substeps = 1;
      other.settings.iterations = iterations.value_or(default_settings(Algorithm::a2).iterations);
      add(std::move(other));
    }
    for (const Algorithm algorithm : grid.algorithms) {
      Settings start = usual_settings(scene, algorithm);
      start.step = job.settings.step;
      if (iterations) start.iterations = *iterations;
      if (job.is_limit) start.substeps = 1;  // the search varies it
      for (const Settings& settings : combinations(start, grid.lists)) {
        SweepJob own = job;
        own.settings = as_read(settings);
        add(std::move(own));
      }
    }
  }

  Sweep sweep_;
  std::set<std::string> keys_;
};

}  // namespace

double Sweep::horizon_of(const std::string& scene) const {
  const auto own = horizons.find(scene);
  return std::min(own == horizons.end() ? horizon : own->second, scenes.at(scene).duration);
}

Sweep read_sweep(const fs::path& file) {
  return Reader(file).read();
}

Sweep sweep_of(const std::vector<fs::path>& scenes, bool maps) {
  return Reader(fs::path()).sweep_of(scenes, maps);
}

}  // namespace substep
