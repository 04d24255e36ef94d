#include "golden/approval/approve.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <ctime>
#include <functional>
#include <map>
#include <utility>

#include "golden/check/check.h"
#include "golden/compare/provenance.h"
#include "golden/suite/sidecar.h"
#include "golden/suite/suite.h"
#include "render/image.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

struct NewGolden {
  fs::path file;
  std::string content;
};

/// Returns folder/text. Throws Error where `text`, from a results.json that may be foreign, leaves the
/// folder.
fs::path inside(const fs::path& folder, const std::string& text) {
  const fs::path path = text;
  if (path.is_absolute() || std::ranges::find(path, "..") != path.end())
    throw Error("the results name {}, outside {}: run 'substep check' again", text, folder.string());
  return folder / path;
}

/// Returns the sidecar without fields that may differ between two equal sets of goldens.
Json comparable(Json sidecar) {
  sidecar.erase("made_with");
  sidecar.erase("approved");
  return sidecar;
}

/// Returns true where the golden equals `content`: pictures by their pixels, other files by their bytes.
bool is_equal(const fs::path& golden, const std::string& golden_bytes, const std::string& content) {
  if (golden_bytes == content) return true;
  if (golden.extension() != ".png" || golden_bytes.empty()) return false;
  try {
    const render::Image old = render::from_png(golden_bytes, golden.string());
    const render::Image fresh = render::from_png(content, golden.string());
    return old.width == fresh.width && old.rgb == fresh.rgb;
  } catch (const Error&) {
    return false;  // a damaged golden is one to replace
  }
}

/// Adds the approval's date and reason; earlier approvals are in the repository's history. A case that passes
/// keeps its approval and provenance where files are rewritten, since its states and pictures are the same.
void note_approval(const Json& entry, const Json& old, const std::string& reason, Json& sidecar) {
  if (old.is_object() && old.contains("approved") && entry.at("verdict") == "pass") {
    sidecar["made_with"] = old.at("made_with");
    sidecar["approved"] = old.at("approved");
  } else {
    sidecar["approved"] = {{"date", fmt::format("{:%F}", fmt::gmtime(std::time(nullptr)))},
                           {"reason", reason}};
  }
}

/// A function that returns the current hash of a case's scene. Throws Error where it cannot be loaded.
using SceneHash = std::function<std::string(const std::string& case_name)>;

/// Returns the files to write for one case, the sidecar last; empty where its goldens already equal the
/// check's results. Throws Error where the case cannot be approved.
std::vector<NewGolden> new_goldens(const Json& entry, const ApproveOptions& options,
                                   const fs::path& suite_folder, const SceneHash& scene_hash) {
  const auto refuse = [&](const std::string& why) {
    throw Error("{} is not approved: {}; nothing was written", entry.at("name").get<std::string>(), why);
  };
  if (const auto refusal = entry.at("refusal").get<std::string>(); !refusal.empty()) refuse(refusal);
  Json sidecar = entry.at("sidecar");
  if (scene_hash(entry.at("name")) != sidecar.at("scene_hash"))
    refuse("its scene is no longer what the check loaded: run 'substep check' again");
  std::vector<NewGolden> files;
  for (const Json& candidate : entry.at("candidates")) {
    const fs::path from = inside(options.output, candidate.at("from"));
    const fs::path to = inside(suite_folder, candidate.at("to"));
    std::string content = content_of(from).value_or("");
    if (content_hash(content) != candidate.at("from_hash"))
      refuse(fmt::format("{} is no longer what the check left: run 'substep check' again", from.string()));
    const std::string golden = content_of(to).value_or("");
    if (is_equal(to, golden, content)) continue;
    if ((golden.empty() ? std::string() : content_hash(golden)) != candidate.at("to_hash"))
      refuse(fmt::format("{} is no longer what the check saw: run 'substep check' again", to.string()));
    if (to.extension() == ".png") content = render::to_small_png(render::from_png(content, from.string()));
    files.push_back({to, std::move(content)});
  }
  const fs::path sidecar_file = inside(suite_folder, entry.at("sidecar_file"));
  const Json old = Json::parse(content_of(sidecar_file).value_or(""), nullptr, false);
  if (!files.empty() || !old.is_object() || comparable(old) != comparable(sidecar)) {
    note_approval(entry, old, options.reason, sidecar);
    files.push_back({sidecar_file, sidecar_text(sidecar)});
  }
  return files;
}

/// Returns the files to write for all chosen cases. Appends cases without any to `approval.already_good`.
std::vector<NewGolden> all_new_goldens(const Json& results, const ApproveOptions& options, const Suite& suite,
                                       Approval& approval) {
  if (results.at("suite_hash") != content_hash(read_bytes(suite.file))) {
    throw Error("{} is not the suite file that was checked: run 'substep check' again",
                options.suite.string());
  }
  const Json& cases = results.at("cases");
  if (options.all_failed && !results.at("ended").get<bool>()) {
    throw Error("{}: the check did not end: {} of {} cases were checked: run 'substep check' again",
                options.output.string(), cases.size(), results.at("of").get<int>());
  }
  std::vector<std::string> checked;
  for (const Json& entry : cases) checked.push_back(entry.at("name"));
  for (const std::string& wanted : options.cases) {
    if (std::ranges::none_of(checked, [&](const std::string& name) { return is_named(name, wanted); })) {
      throw Error("the last check had no case '{}'; it had {}", wanted, fmt::join(checked, " "));
    }
  }
  std::map<fs::path, std::string> hashes;  // by file
  const auto scene_hash = [&](const std::string& case_name) {
    const fs::path scene = select(suite, {case_name}).at(0).scene;
    std::string& hash = hashes[scene];
    if (hash.empty()) hash = hash_text(load_scene(scene).hash);
    return hash;
  };
  std::vector<NewGolden> all;
  for (const Json& entry : cases) {
    const auto name = entry.at("name").get<std::string>();
    const bool is_chosen =
        std::ranges::any_of(options.cases, [&](const std::string& wanted) { return is_named(name, wanted); });
    const bool passed = entry.at("verdict") == "pass";
    if (!is_chosen && (!options.all_failed || passed)) continue;
    // The sidecar of a case that passes may be out of date.
    const bool is_up_to_date = passed && !entry.contains("sidecar");
    std::vector<NewGolden> files;
    if (!is_up_to_date) files = new_goldens(entry, options, suite.folder(), scene_hash);
    if (files.empty()) approval.already_good.push_back(name);
    std::ranges::move(files, std::back_inserter(all));
  }
  return all;
}

}  // namespace

Approval approve(const ApproveOptions& options) {
  if (!options.all_failed && options.cases.empty())
    throw Error("approve needs the names of cases, or --failed for all that did not pass");
  if (options.reason.find_first_not_of(". \t\n") == std::string::npos)
    throw Error("approve needs a reason: --reason \"why the goldens change\"");
  const Json results = read_results(options.output);
  Approval approval;
  std::vector<NewGolden> files;
  try {
    files = all_new_goldens(results, options, read_suite(options.suite), approval);
  } catch (const Json::exception& error) {
    throw Error("{}: is damaged: run 'substep check' again ({})", results_file(options.output).string(),
                error.what());
  }
  for (const NewGolden& file : files) {
    fs::create_directories(file.file.parent_path());
    write_file(file.file, file.content);
    approval.written.push_back(file.file);
  }
  return approval;
}

}  // namespace substep::golden
