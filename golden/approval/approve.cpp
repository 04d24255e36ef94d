#include "golden/approval/approve.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "golden/check/check_results.h"
#include "golden/compare/provenance.h"
#include "golden/compare/verdict.h"
#include "golden/suite/sidecar.h"
#include "render/image.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct NewGolden {
  fs::path file;
  std::string content;
};

/// Each file is the old or the new one at any time. The sidecar comes last: until then its hashes are not
/// those of the files beside it, which a check reports.
void write_goldens(const std::vector<NewGolden>& files) {
  for (const NewGolden& file : files) {
    fs::create_directories(file.file.parent_path());
    write_file(file.file, file.content);
  }
}

[[noreturn]] void refuse(const std::string& case_name, const std::string& why) {
  throw Error(fmt::format("{} is not approved: {}; nothing was written", case_name, why));
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  return fmt::format("{:04}-{:02}-{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday);
}

/// The sidecar without what may differ between two equal sets of goldens.
Json essence(Json sidecar) {
  sidecar.erase("made_with");
  sidecar.erase("approved");
  sidecar.erase("history");
  return sidecar;
}

bool says_the_same(const fs::path& sidecar, const Json& expected) {
  if (!fs::exists(sidecar)) return false;
  const Json present = Json::parse(read_bytes(sidecar), nullptr, false);
  return present.is_object() && essence(present) == essence(expected);
}

/// What the check left, unless it is something else by now.
std::string shown(const fs::path& file, const std::string& hash, const std::string& case_name) {
  std::string content = fs::exists(file) ? read_bytes(file) : std::string();
  if (content_hash(content) != hash) {
    refuse(case_name,
           fmt::format("{} is no longer what the check left: run 'substep check' again", file.string()));
  }
  return content;
}

/// The picture that a golden file will hold: another file than the check left, with the same pixels.
std::string kept(const fs::path& to, std::string content) {
  return to.extension() == ".png" ? render::to_small_png(render::from_png(content, to.string()))
                                  : std::move(content);
}

/// Whether the golden says what `content` does already. What makes a picture is its pixels.
bool holds(const fs::path& golden, const std::string& golden_bytes, const std::string& content) {
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

/// When and why, after what was noted of the approvals before. What passes has the same states and pictures:
/// its approval stays, whatever of its files is written anew.
void note_approval(const CheckResults::Case& entry, const ApproveOptions& options, Json& sidecar) {
  const Json old =
      fs::exists(entry.sidecar_file) ? Json::parse(read_bytes(entry.sidecar_file), nullptr, false) : Json();
  const bool has_old = old.is_object() && old.contains("approved");
  if (has_old && entry.verdict == name(Verdict::pass)) {
    sidecar["made_with"] = old.at("made_with");
    sidecar["approved"] = old.at("approved");
  } else {
    sidecar["approved"] = {{"date", today()}, {"reason", options.reason}};
  }
  if (old.is_object() && old.contains("history")) sidecar["history"] = old.at("history");
  if (!has_old || sidecar["approved"] == old.at("approved")) return;
  Json before = old.at("approved");
  before["commit"] = old.value("made_with", Json::object()).value("commit", std::string());
  sidecar["history"].push_back(std::move(before));
}

/// Deletes the goldens of no case that the check named, if they are still what it saw.
void prune(const CheckResults& results, const fs::path& suite_file_here, Approval& approval) {
  const std::vector<fs::path> still = orphans(read_suite(suite_file_here));
  for (const CheckResults::Orphan& orphan : results.orphans) {
    const auto is_it = [&](const fs::path& file) {
      return file.lexically_normal() == orphan.file.lexically_normal();
    };
    if (std::none_of(still.begin(), still.end(), is_it)) continue;
    if (content_hash(read_bytes(orphan.file)) != orphan.hash) {
      throw Error(fmt::format("{} is not deleted: it changed since the check", orphan.file.string()));
    }
    approval.size_change -= static_cast<std::int64_t>(fs::file_size(orphan.file));
    fs::remove(orphan.file);
    approval.deleted.push_back(orphan.file);
  }
}

/// What is to be written for one case; empty when its goldens are those of the check already.
std::vector<NewGolden> files_of(const CheckResults::Case& entry, const ApproveOptions& options) {
  if (!entry.refusal.empty()) refuse(entry.name, entry.refusal);
  std::vector<NewGolden> files;
  for (const ApprovalCandidate& candidate : entry.candidates) {
    const std::string content = shown(candidate.from, candidate.from_hash, entry.name);
    const std::string golden = fs::exists(candidate.to) ? read_bytes(candidate.to) : std::string();
    if (holds(candidate.to, golden, content)) continue;
    if ((golden.empty() ? std::string() : content_hash(golden)) != candidate.to_hash) {
      refuse(entry.name, fmt::format("{} is no longer what the check saw: run 'substep check' again",
                                     candidate.to.string()));
    }
    files.push_back({candidate.to, kept(candidate.to, content)});
  }
  if (!files.empty() || !says_the_same(entry.sidecar_file, entry.sidecar)) {
    Json sidecar = entry.sidecar;
    note_approval(entry, options, sidecar);
    files.push_back({entry.sidecar_file, sidecar_text(sidecar)});
  }
  return files;
}

}  // namespace

Approval approve(const ApproveOptions& options) {
  const bool needs_reason = options.all_failed || !options.cases.empty();
  if (needs_reason && options.reason.find_first_not_of(" \t\n") == std::string::npos) {
    throw Error("approve needs a reason: --reason \"why the goldens change\"");
  }
  if (!needs_reason && !options.renews && !options.prunes) {
    throw Error("approve needs the names of cases, or --failed for all that did not pass");
  }
  const fs::path suite_folder = suite_file(options.suite).parent_path();
  const CheckResults results = read_results(options.output, suite_folder);
  if (content_hash(read_bytes(suite_file(options.suite))) != results.suite_hash) {
    throw Error(fmt::format("{} is not the suite file that was checked: run 'substep check' again",
                            options.suite.string()));
  }
  for (const std::string& wanted : options.cases) {
    if (std::none_of(results.cases.begin(), results.cases.end(),
                     [&](const auto& c) { return c.name == wanted; })) {
      throw Error(fmt::format("the last check had no case '{}'", wanted));
    }
  }
  // All that can be refused is, before anything is written.
  std::vector<std::vector<NewGolden>> cases;
  Approval approval;
  for (const CheckResults::Case& entry : results.cases) {
    const bool is_named =
        std::find(options.cases.begin(), options.cases.end(), entry.name) != options.cases.end();
    const bool passed = entry.verdict == name(Verdict::pass);
    const bool is_renewed = options.renews && passed && entry.sidecar.is_object();
    if (!is_named && !is_renewed && (!options.all_failed || passed)) continue;
    std::vector<NewGolden> files;
    // A case that passes may still lack a track.
    const bool has_nothing = passed && !entry.sidecar.is_object();
    if (!has_nothing) files = files_of(entry, options);
    if (files.empty()) {
      approval.already_good.push_back(entry.name);
    } else {
      cases.push_back(std::move(files));
    }
  }
  for (const std::vector<NewGolden>& files : cases) {
    for (const NewGolden& file : files) {
      std::error_code none;
      const auto old_size = fs::file_size(file.file, none);
      approval.size_change += static_cast<std::int64_t>(file.content.size());
      if (!none) approval.size_change -= static_cast<std::int64_t>(old_size);
      approval.written.push_back(file.file);
    }
    write_goldens(files);
  }
  if (options.prunes) prune(results, options.suite, approval);
  return approval;
}

}  // namespace substep::golden
