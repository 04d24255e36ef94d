#include "sim/study/sweep_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/toml_values.h"
#include "sim/study/engines/engines.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// The settings that the algorithm does not read, at one value: so that equal runs have equal keys.
Settings as_read(Settings settings) {
  if (settings.algorithm < Algorithm::a3) {
    settings.substeps = 1;
    settings.tau = settings.kappa = 1;
    settings.joints = Joints::rows;
  }
  if (settings.algorithm == Algorithm::a1) settings.iterations = 1;
  return settings;
}

std::string key_of(const SweepJob& job) {
  const Settings& s = job.settings;
  if (!job.engine.empty())
    return fmt::format("{}.{}-h{}-m{}", job.scene, job.engine, job.divisions, s.iterations);
  std::string text = fmt::format("{}.{}", job.scene, name(s.algorithm));
  text += job.is_limit ? "-limit" : fmt::format("-h{}", job.divisions);
  if (s.algorithm >= Algorithm::a3 && !job.is_limit) text += fmt::format("-n{}", s.substeps);
  if (s.algorithm >= Algorithm::a2) text += fmt::format("-m{}", s.iterations);
  if (s.algorithm >= Algorithm::a3) text += fmt::format("-t{:g}-k{:g}-{}", s.tau, s.kappa, name(s.joints));
  return text;
}

class Reader : private TomlValues {
 public:
  explicit Reader(const fs::path& path) : TomlValues(path) { sweep_.file = path; }

  Sweep read() {
    const toml::table root = parse();
    expect_keys(root, "the sweep file", {"horizon", "repetitions", "most", "horizons", "grid", "limit"});
    if (const auto* node = root.get("horizon")) sweep_.horizon = positive(*node, "horizon");
    if (const auto* node = root.get("repetitions"))
      sweep_.repetitions = integer(*node, "repetitions", 0, 1000);
    if (const auto* node = root.get("most")) sweep_.most = integer(*node, "most", 1, 4096);
    for (const char* const kind : {"grid", "limit"}) {
      const toml::node* const list = root.get(kind);
      if (list == nullptr) continue;
      if (!list->is_array_of_tables()) fail(*list, fmt::format("'{0}' must be tables: [[{0}]]", kind));
      for (const toml::node& node : *list->as_array()) {
        read_grid(*node.as_table(), std::string_view(kind) == "limit");
      }
    }
    if (sweep_.jobs.empty()) throw Error(fmt::format("{}: has no [[grid]]", sweep_.file.string()));
    if (const auto* node = root.get("horizons")) {
      if (!node->is_table()) fail(*node, "'horizons' must be a table");
      for (const auto& [scene, value] : *node->as_table()) {
        if (!sweep_.scenes.contains(std::string(scene.str()))) {
          fail(value, fmt::format("'{}' is a scene of no grid", scene.str()));
        }
        sweep_.horizons[std::string(scene.str())] = positive(value, scene.str());
      }
    }
    return std::move(sweep_);
  }

 private:
  double positive(const toml::node& node, std::string_view key) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !(*value > 0 && *value < 1e6))
      fail(node, fmt::format("'{}' must be a number above 0", key));
    return *value;
  }

  /// The entries of a list, or `otherwise` where there is none.
  template <typename Value, typename Read>
  std::vector<Value> list(const toml::table& table, std::string_view key, std::vector<Value> otherwise,
                          const Read& read) const {
    const toml::node* const node = table.get(key);
    if (node == nullptr) return otherwise;
    std::vector<Value> values;
    for (const toml::node& entry : array(*node, key)) values.push_back(read(entry, key));
    return values;
  }

  const Scene& scene_of(const toml::node& node) {
    const fs::path file = (sweep_.file.parent_path() / text(node, "scenes")).lexically_normal();
    Scene scene = load_scene(file);
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

  void read_grid(const toml::table& table, bool is_limit) {
    std::vector<std::string_view> known{"scenes", "algorithms", "iterations", "tau", "kappa", "joints"};
    if (!is_limit) known.insert(known.end(), {"divisions", "substeps", "engines"});
    expect_keys(table, is_limit ? "[[limit]]" : "[[grid]]", known);
    const auto count = [&](const toml::node& node, std::string_view key) {
      return integer(node, key, 1, 4096);
    };
    const auto factor = [&](const toml::node& node, std::string_view key) { return positive(node, key); };
    const auto algorithms = list<Algorithm>(table, "algorithms", {}, [&](const toml::node& node, auto key) {
      const auto algorithm = algorithm_named(text(node, key));
      if (!algorithm) fail(node, "'algorithms' must be some of a1, a2, a3, a4, a5");
      return *algorithm;
    });
    const auto joints = list<Joints>(table, "joints", {Joints::plain}, [&](const toml::node& node, auto key) {
      const auto value = joints_named(text(node, key));
      if (!value) fail(node, "'joints' must be some of rows, plain, stable");
      return *value;
    });
    const auto names = list<std::string>(table, "engines", {}, [&](const toml::node& node, auto key) {
      const std::string engine = text(node, key);
      if (engine.empty() ||
          engine.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos) {
        fail(node, "'engines' must be of small letters, digits and -");
      }
      return engine;
    });
    const auto divisions = list<int>(table, "divisions", {1}, count);
    const auto substeps = list<int>(table, "substeps", {1}, count);
    const auto iterations = list<int>(table, "iterations", {1}, count);
    const auto taus = list<double>(table, "tau", {1.0}, factor);
    const auto kappas = list<double>(table, "kappa", {1.0}, factor);
    const toml::node* const scenes = table.get("scenes");
    if (scenes == nullptr) fail(table, "a grid without 'scenes'");
    if (!scenes->is_array() || scenes->as_array()->empty()) fail(*scenes, "'scenes' must be a list");
    if (algorithms.empty() && names.empty()) fail(table, "a grid without 'algorithms'");
    for (const toml::node& entry : *scenes->as_array()) {
      const Scene& scene = scene_of(entry);
      SweepJob job;
      job.scene = scene.name;
      job.is_limit = is_limit;
      for (const int division : divisions) {
        job.divisions = division;
        job.settings.step = scene.step / division;
        for (const int m : iterations) {
          job.settings.iterations = m;
          for (const std::string& engine : names) {
            SweepJob other = job;
            other.engine = engine;
            add(std::move(other));
          }
          for (const Algorithm algorithm : algorithms) {
            for (const int n : substeps) {
              for (const double tau : taus) {
                for (const double kappa : kappas) {
                  for (const Joints treatment : joints) {
                    SweepJob own = job;
                    own.settings.algorithm = algorithm;
                    own.settings.substeps = n;
                    own.settings.tau = tau;
                    own.settings.kappa = kappa;
                    own.settings.joints = treatment;
                    own.settings = as_read(own.settings);
                    try {
                      check(own.settings);
                    } catch (const Error& error) {
                      fail(table, error.what());
                    }
                    add(std::move(own));
                  }
                }
              }
            }
          }
        }
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

}  // namespace substep
