#include "golden/approve.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "golden/check_results.h"
#include "golden/provenance.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct NewFile {
  fs::path file;
  std::string content;
};

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
  return sidecar;
}

bool says_the_same(const fs::path& sidecar, const Json& expected) {
  if (!fs::exists(sidecar)) return false;
  const Json present = Json::parse(read_bytes(sidecar), nullptr, false);
  return present.is_object() && essence(present) == essence(expected);
}

/// What is to be written for one case; empty when its goldens are those of the check already.
std::vector<NewFile> files_of(const CheckResults::Case& entry, const ApproveOptions& options) {
  const auto refuse = [&](const std::string& why) {
    throw Error(fmt::format("{} is not approved: {}; nothing was written", entry.name, why));
  };
  if (!entry.refusal.empty()) refuse(entry.refusal);
  std::vector<NewFile> files;
  for (const Offer& offer : entry.offers) {
    const std::string content = fs::exists(offer.from) ? read_bytes(offer.from) : std::string();
    if (content_hash(content) != offer.from_hash) {
      refuse(
          fmt::format("{} is no longer what the check left: run 'substep check' again", offer.from.string()));
    }
    const std::string golden_hash = fs::exists(offer.to) ? content_hash(read_bytes(offer.to)) : std::string();
    if (golden_hash == offer.from_hash) continue;
    if (golden_hash != offer.to_hash) {
      refuse(fmt::format("{} is no longer what the check saw: run 'substep check' again", offer.to.string()));
    }
    files.push_back({offer.to, content});
  }
  if (!files.empty() || !says_the_same(entry.sidecar_file, entry.sidecar)) {
    Json sidecar = entry.sidecar;
    sidecar["approved"] = {{"date", today()}, {"reason", options.reason}};
    files.push_back({entry.sidecar_file, sidecar.dump(1) + "\n"});
  }
  return files;
}

}  // namespace

Approval approve(const ApproveOptions& options) {
  if (options.reason.find_first_not_of(" \t\n") == std::string::npos) {
    throw Error("approve needs a reason: --reason \"why the goldens change\"");
  }
  if (options.cases.empty() && !options.all_failed) {
    throw Error("approve needs the names of cases, or --failed for all that did not pass");
  }
  const CheckResults results = read_results(options.output);
  if (content_hash(read_bytes(options.suite)) != results.suite_hash) {
    throw Error(fmt::format("{} is not the suite file that was checked: run 'substep check' again",
                            options.suite.string()));
  }
  for (const std::string& wanted : options.cases) {
    if (std::none_of(results.cases.begin(), results.cases.end(),
                     [&](const auto& c) { return c.name == wanted; })) {
      throw Error(fmt::format("the last check had no case '{}'", wanted));
    }
  }
  Approval approval;
  std::vector<NewFile> files;
  for (const CheckResults::Case& entry : results.cases) {
    const bool is_named =
        std::find(options.cases.begin(), options.cases.end(), entry.name) != options.cases.end();
    const bool passed = entry.verdict == name(Verdict::pass);
    if (!is_named && (!options.all_failed || passed)) continue;
    std::vector<NewFile> own = passed ? std::vector<NewFile>() : files_of(entry, options);
    if (own.empty()) approval.already_good.push_back(entry.name);
    std::move(own.begin(), own.end(), std::back_inserter(files));
  }
  for (const NewFile& file : files) {
    std::error_code none;
    const auto old_size = fs::file_size(file.file, none);
    approval.size_change += static_cast<std::int64_t>(file.content.size());
    if (!none) approval.size_change -= static_cast<std::int64_t>(old_size);
    fs::create_directories(file.file.parent_path(), none);
    write_file(file.file, file.content);
    approval.written.push_back(file.file);
  }
  return approval;
}

}  // namespace substep
