#include "golden/suite/suite.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "sim/error.h"
#include "sim/loading/toml_values.h"
#include "sim/log/pose_table.h"
#include "sim/model/usual_settings.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

constexpr int largest_count = 100000;
constexpr int largest_size = 4096;
const std::vector<std::string_view> algorithm_keys{"a1", "a2", "a3", "a4", "a5", "soft", "avbd"};
const std::vector<std::string_view> plan_keys{"frames",     "full_every", "images",    "size",
                                              "algorithms", "command",    "tolerance", "pose_tolerance",
                                              "settings",   "time_limit", "renderer"};

/// Returns the keys of [settings]: all fields but the algorithm, which `algorithms` names.
std::vector<std::string_view> settings_keys() {
  std::vector<std::string_view> keys;
  for (const SettingsField& field : settings_fields) {
    if (field.name != "algorithm") keys.push_back(field.name);
  }
  return keys;
}

/// The keys that [defaults] and a [[case]] share; a case starts from the defaults.
struct Plan {
  SuiteCase entry;  ///< without name, golden files and settings: see add_case()
  std::vector<Algorithm> algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4,
                                    Algorithm::a5};
  std::vector<const toml::table*> settings;  ///< applied in this order

  bool is_foreign() const { return !entry.command.empty() || !entry.poses.empty(); }
};

class Reader : private TomlValues {
 public:
  using TomlValues::TomlValues;

  Suite read() {
    const toml::table root = parse();
    expect_keys(root, "the suite file", {"defaults", "case"});
    Plan defaults;
    defaults.entry.images = {60, 120};
    if (const toml::node* node = root.get("defaults")) {
      const toml::table& table = table_in(*node, "defaults");
      expect_keys(table, "[defaults]", plan_keys);
      read_plan(table, defaults);
    }
    Suite suite{file(), {}};
    const toml::node* cases = root.get("case");
    if (cases == nullptr) throw Error("{}: has no [[case]]", file().string());
    if (!cases->is_array_of_tables()) fail(*cases, "'case' must be tables: [[case]]");
    for (const toml::node& node : *cases->as_array()) read_case(*node.as_table(), defaults, suite);
    return suite;
  }

 private:
  /// Returns a number that is at least 0.
  double number(const toml::node& node, std::string_view key) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !(*value >= 0 && *value < 1e300))
      fail(node, fmt::format("'{}' must be a number, at least 0", key));
    return *value;
  }

  /// Sets the value where the table has the key.
  void read(const toml::table& table, std::string_view key, int low, int high, auto& value) const {
    if (const toml::node* const node = table.get(key)) value = integer(*node, key, low, high);
  }

  void read_tolerances(const toml::table& table, SuiteCase& entry) const {
    if (const auto* node = table.get("tolerance")) {
      const toml::table& own = table_in(*node, "tolerance");
      expect_keys(own, "tolerance", {"hard", "level", "count", "flip"});
      if (const auto* flip = own.get("flip")) entry.tolerance.flip = number(*flip, "flip");
      read(own, "hard", 0, 255, entry.tolerance.hard);
      read(own, "level", 0, 255, entry.tolerance.level);
      read(own, "count", 0, largest_size * largest_size, entry.tolerance.count);
    }
    if (const auto* node = table.get("pose_tolerance")) {
      const toml::table& own = table_in(*node, "pose_tolerance");
      expect_keys(own, "pose_tolerance", {"position", "orientation", "energy", "penetration", "resting"});
      PoseTolerance& limits = entry.pose_tolerance ? *entry.pose_tolerance : entry.pose_tolerance.emplace();
      for (const auto& [key, value] :
           {std::pair("position", &limits.position), std::pair("orientation", &limits.orientation),
            std::pair("energy", &limits.energy), std::pair("penetration", &limits.penetration)}) {
        if (const auto* limit = own.get(key)) *value = number(*limit, key);
      }
      read(own, "resting", 0, largest_count, limits.resting);
    }
  }

  void read_plan(const toml::table& table, Plan& plan) const {
    read(table, "frames", 1, largest_count, plan.entry.frames);
    read(table, "full_every", 1, largest_count, plan.entry.full_every);
    if (const auto* node = table.get("images")) {
      plan.entry.images.clear();
      const bool has_none = node->is_array() && node->as_array()->empty();  // poses alone
      for (const toml::node& frame : has_none ? *node->as_array() : array(*node, "images"))
        plan.entry.images.push_back(integer(frame, "images", 0, largest_count));
      std::ranges::sort(plan.entry.images);
    }
    if (const auto* node = table.get("size")) {
      const toml::array& size = array(*node, "size");
      if (size.size() != 2) fail(*node, "'size' must be [width, height]");
      plan.entry.width = integer(size[0], "size", 16, largest_size);
      plan.entry.height = integer(size[1], "size", 16, largest_size);
    }
    read_origin(table, plan);
    read_tolerances(table, plan.entry);
    if (const auto* node = table.get("renderer")) {
      const std::string renderer = text(*node, "renderer");
      if (renderer != "any" && renderer != "pinned") fail(*node, "'renderer' must be \"pinned\" or \"any\"");
      plan.entry.any_renderer = renderer == "any";
    }
    if (const auto* node = table.get("time_limit")) plan.entry.time_limit = number(*node, "time_limit");
    if (const auto* node = table.get("settings")) {
      const toml::table& settings = table_in(*node, "settings");
      for (const auto& [key, value] : settings) {
        if (std::ranges::find(algorithm_keys, key.str()) == algorithm_keys.end()) continue;
        expect_keys(table_in(value, key.str()), fmt::format("settings.{}", key.str()), settings_keys());
      }
      plan.settings.push_back(&settings);
    }
  }

  /// Sets the case's settings that the table of [settings] has.
  void apply(const toml::table& table, SuiteCase& result) const {
    const std::vector<std::string_view> keys = settings_keys();
    // Set contact_tau and contact_kappa after τ and κ, which set all rows: the fields have this order.
    for (const std::string_view key : keys) {
      const toml::node* const node = table.get(key);
      if (node == nullptr) continue;
      set_field(result.settings, field_named(key), *node);
      result.own_settings.push_back(field_named(key).name);
    }
    for (const auto& [key_name, node] : table) {
      const std::string_view key = key_name.str();
      if (std::ranges::find(keys, key) == keys.end() &&
          std::ranges::find(algorithm_keys, key) == algorithm_keys.end()) {
        fail(node, fmt::format("unknown key '{}' in settings; known are {}, and a table for one of {}", key,
                               fmt::join(keys, ", "), fmt::join(algorithm_keys, ", ")));
      }
    }
  }

  /// Reads where the poses come from: one of `algorithms`, `command` and `poses`, which replaces that of
  /// [defaults].
  void read_origin(const toml::table& table, Plan& plan) const {
    const toml::node* const algorithms = table.get("algorithms");
    const toml::node* const command = table.get("command");
    const toml::node* const poses = table.get("poses");
    const int given = (algorithms != nullptr) + (command != nullptr) + (poses != nullptr);
    if (given == 0) return;
    if (given > 1) fail(table, "give one of 'algorithms', 'command' and 'poses'");
    SuiteCase& entry = plan.entry;
    entry.command.clear();
    entry.author.clear();
    if (algorithms != nullptr) plan.algorithms = this->algorithms(*algorithms, "algorithms");
    if (command != nullptr) {
      for (const toml::node& word : array(*command, "command"))
        entry.command.push_back(text(word, "command"));
      entry.command = with_files_in(std::move(entry.command), file().parent_path());
      entry.author = command_engine(entry.command).label;
    }
    if (poses != nullptr) {
      entry.poses = (file().parent_path() / text(*poses, "poses")).lexically_normal();
      if (!is_pose_table(entry.poses)) fail(*poses, "'poses' must be a pose table, *.csv");
      entry.author = entry.poses.stem().string();
    }
    if (plan.is_foreign() && (!is_case_name(entry.author) || algorithm_named(entry.author))) {
      fail(table, fmt::format("'{}' cannot name a run: its file needs a name of letters, digits, _ and -, "
                              "other than an algorithm's",
                              entry.author));
    }
  }

  void read_case(const toml::table& table, const Plan& defaults, Suite& suite) {
    std::vector<std::string_view> keys{"scene", "variant", "poses"};
    keys.insert(keys.end(), plan_keys.begin(), plan_keys.end());
    expect_keys(table, "[[case]]", keys);
    Plan plan = defaults;
    read_plan(table, plan);
    SuiteCase& entry = plan.entry;
    const toml::node* scene = table.get("scene");
    if (scene == nullptr) fail(table, "[[case]] without a 'scene'");
    entry.scene = text(*scene, "scene");
    if (!is_case_name(entry.scene.stem().string())) {
      fail(*scene,
           fmt::format("scene '{}': its name must be of letters, digits, _ and -", entry.scene.string()));
    }
    entry.scene = (suite.folder() / entry.scene).lexically_normal();
    std::string variant;
    if (const auto* node = table.get("variant")) {
      variant = text(*node, "variant");
      if (!is_case_name(variant)) fail(*node, "'variant' must be of letters, digits, _ and -");
    }
    for (const int frame : entry.images) {
      if (frame > entry.frames || (frame % entry.full_every != 0 && frame != entry.frames)) {
        fail(table,
             fmt::format("image of frame {}: must be a multiple of full_every = {} or the last frame, {}",
                         frame, entry.full_every, entry.frames));
      }
    }
    // A simulator gets the iterations of A2, as an engine's panel does.
    if (plan.is_foreign()) plan.algorithms = {Algorithm::a2};
    for (const Algorithm algorithm : plan.algorithms) add_case(table, plan, algorithm, variant, suite);
  }

  /// Adds the case of one algorithm. `variant`: empty, or what distinguishes its name.
  void add_case(const toml::table& table, const Plan& plan, Algorithm algorithm, const std::string& variant,
                Suite& suite) {
    SuiteCase result = plan.entry;
    const std::string author = plan.is_foreign() ? result.author : std::string(name(algorithm));
    const std::string slug = variant.empty() ? author : fmt::format("{}-{}", author, variant);
    const std::string scene_name = result.scene.stem().string();
    result.name = fmt::format("{}.{}", scene_name, slug);
    result.settings = default_settings(algorithm);
    for (const toml::table* settings : plan.settings) {
      apply(*settings, result);
      const auto* own = settings->get_as<toml::table>(name(algorithm));
      if (own != nullptr && !plan.is_foreign()) apply(*own, result);
    }
    try {
      check(result.settings);
    } catch (const Error& error) {
      fail(table, fmt::format("{}: {}", result.name, error.what()));
    }
    result.suite_folder = suite.folder();
    result.pose_file = suite.folder() / "poses" / scene_name / (slug + ".poses");
    result.track_file = fs::path(result.pose_file).replace_extension(".track");
    result.sidecar = suite.folder() / "images" / scene_name / (slug + ".json");
    if (!names_.insert(result.name).second) {
      fail(table, fmt::format("there is a case {} already: give one of them a 'variant'", result.name));
    }
    suite.cases.push_back(std::move(result));
  }

  std::set<std::string> names_;
};

}  // namespace

Settings SuiteCase::settings_for(const Scene& loaded) const {
  const Settings usual = usual_settings(loaded, settings.algorithm);
  Settings result = settings;
  for (const std::string_view field : {"step", "substeps", "iterations", "joints"}) {
    if (std::ranges::find(own_settings, field) == own_settings.end()) copy(result, field_named(field), usual);
  }
  return result;
}

fs::path SuiteCase::image_file(int frame) const {
  fs::path file = sidecar;
  return file.replace_extension(fmt::format(".f{:04}.png", frame));
}

bool is_case_name(std::string_view name) {
  return !name.empty() && name.front() != '-' && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
}

Suite read_suite(const fs::path& file) {
  std::error_code none;
  return Reader(fs::is_directory(file, none) ? file / "suite.toml" : file).read();
}

bool is_named(std::string_view case_name, std::string_view name) {
  return case_name == name || case_name.starts_with(fmt::format("{}.", name));
}

std::vector<SuiteCase> select(const Suite& suite, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (std::ranges::any_of(suite.cases, [&](const auto& entry) { return is_named(entry.name, name); }))
      continue;
    std::vector<std::string_view> known;
    for (const SuiteCase& entry : suite.cases) known.push_back(entry.name);
    throw Error("{}: has no case '{}'; cases are {}", suite.file.string(), name, fmt::join(known, " "));
  }
  std::vector<SuiteCase> chosen = suite.cases;
  std::erase_if(chosen, [&](const SuiteCase& entry) {
    const auto names_it = [&](const std::string& name) { return is_named(entry.name, name); };
    return !names.empty() && std::ranges::none_of(names, names_it);
  });
  return chosen;
}

std::vector<fs::path> orphans(const Suite& suite) {
  std::set<fs::path> claimed;
  for (const SuiteCase& entry : suite.cases) {
    for (const fs::path& file : {entry.pose_file, entry.track_file, entry.sidecar}) {
      claimed.insert(file.lexically_normal());
      claimed.insert(file.parent_path().lexically_normal());
    }
    for (const int frame : entry.images) claimed.insert(entry.image_file(frame).lexically_normal());
  }
  std::vector<fs::path> result;
  for (const char* folder : {"poses", "images"}) {
    std::error_code none;
    constexpr auto skip = fs::directory_options::skip_permission_denied;
    for (const auto& entry : fs::recursive_directory_iterator(suite.folder() / folder, skip, none)) {
      const bool is_folder = entry.is_directory(none);
      // List a folder of no case that cannot be read, since its files may be orphans.
      if (is_folder) fs::directory_iterator(entry.path(), none);
      if (is_folder && !none) continue;
      // File managers create .DS_Store, Thumbs.db and the like.
      const std::string name = entry.path().filename().string();
      if (name.starts_with('.') || name == "Thumbs.db" || name == "desktop.ini") continue;
      if (claimed.count(entry.path().lexically_normal()) == 0) result.push_back(entry.path());
    }
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace substep::golden
