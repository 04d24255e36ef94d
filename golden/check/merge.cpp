#include "golden/check/merge.h"

#include <fmt/format.h>

#include <array>
#include <set>
#include <string>

#include "golden/check/check_results.h"
#include "golden/report/junit.h"
#include "golden/report/report.h"
#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Copies the case's folder, and lets all that names its files name the copies.
void take_files(Json& entry, const fs::path& output) {
  const fs::path from = entry.at("files").get<std::string>();
  const fs::path to = output / from.filename();
  std::error_code none;
  if (fs::is_directory(from, none) && !fs::equivalent(from, to, none)) {
    fs::create_directories(output);
    fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  }
  entry["files"] = to.string();
  for (const char* key : {"offers", "alternates"}) {
    if (!entry.contains(key)) continue;
    for (Json& offer : entry[key]) {
      offer["from"] = (to / fs::path(offer.at("from").get<std::string>()).filename()).string();
    }
  }
}

/// As totals() of a check.
std::string totals_of(const Json& results) {
  constexpr std::array<Verdict, 6> order{
      Verdict::simulation_changed, Verdict::renderer_changed, Verdict::both_changed,
      Verdict::environment,        Verdict::missing,          Verdict::created};
  const auto count = [&](Verdict verdict) {
    int sum = 0;
    for (const Json& entry : results.at("cases")) sum += entry.at("verdict") == name(verdict) ? 1 : 0;
    return sum;
  };
  std::string text;
  for (const Verdict verdict : order) text += fmt::format("{} {}, ", count(verdict), name(verdict));
  return text + fmt::format("{} orphan, {} pass", results.at("orphans").size(), count(Verdict::pass));
}

/// The worst of two checks: 1 is a difference, 3 only the environment, 0 nothing.
int worse(int a, int b) {
  if (a == 1 || b == 1) return 1;
  return a == 3 || b == 3 ? 3 : 0;
}

}  // namespace

int merge(const std::vector<fs::path>& shards, const fs::path& output) {
  Json all;
  std::set<std::string> seen;
  int exit_code = 0;
  try {
    for (const fs::path& shard : shards) {
      Json results = read_results_json(shard);
      // A shard may have been moved here from the machine that ran it.
      for (Json& entry : results["cases"]) {
        entry["files"] = (shard / fs::path(entry.at("files").get<std::string>()).filename()).string();
      }
      exit_code = worse(exit_code, results.at("exit_code"));
      if (!all.is_null() && all.at("suite_hash") != results.at("suite_hash")) {
        throw Error(
            fmt::format("{} and {} are of different suites", shards.front().string(), shard.string()));
      }
      for (Json& entry : results["cases"]) {
        const auto case_name = entry.at("name").get<std::string>();
        if (!seen.insert(case_name).second) {
          throw Error(fmt::format("{}: {} is in another of the shards too", shard.string(), case_name));
        }
        take_files(entry, output);
      }
      if (all.is_null()) {
        all = std::move(results);
        continue;
      }
      for (const char* key : {"cases", "orphans", "distances"}) {
        for (Json& item : results[key]) all[key].push_back(std::move(item));
      }
    }
  } catch (const Json::exception& error) {
    throw Error(fmt::format("results of a shard are damaged: check it again ({})", error.what()));
  }
  all["exit_code"] = exit_code;
  all["totals"] = totals_of(all);
  std::error_code none;
  fs::create_directories(output, none);
  write_results(all, output);
  write_junit(all, output);
  write_report(all, output);
  return exit_code;
}

}  // namespace substep
