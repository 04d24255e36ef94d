#include "golden/check/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "golden/check/check_output.h"
#include "golden/check/check_results.h"
#include "golden/report/junit.h"
#include "golden/report/report.h"
#include "golden/report/summary.h"
#include "golden/suite/suite.h"
#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ShardResults {
  fs::path folder;
  Json results;

  int number() const { return results.at("shard").at(0); }
  int of() const { return results.at("shard").at(1); }
};

/// All of one suite, of one division, none twice.
void expect_parts_of_one(const std::vector<ShardResults>& parts) {
  const ShardResults& first = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const ShardResults& part = parts[i];
    const auto refuse = [&](const char* why) {
      throw Error(fmt::format("{} and {} {}", first.folder.string(), part.folder.string(), why));
    };
    if (part.results.at("suite_hash") != first.results.at("suite_hash")) refuse("are of different suites");
    if (part.of() != first.of() || part.results.at("only") != first.results.at("only")) {
      refuse("are not parts of one check: give all the same --shard …/N and --case");
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (parts[k].number() != part.number()) continue;
      throw Error(fmt::format("{} and {} are both part {} of {}", parts[k].folder.string(),
                              part.folder.string(), part.number(), part.of()));
    }
  }
}

Json missing_parts(const std::vector<ShardResults>& parts) {
  Json missing = Json::array();
  const int of = parts.front().of();
  for (int number = 1; number <= of; ++number) {
    const auto found = std::find_if(parts.begin(), parts.end(),
                                    [&](const ShardResults& part) { return part.number() == number; });
    if (found == parts.end()) {
      missing.push_back(fmt::format("part {} of {} is missing", number, of));
    } else if (!found->results.at("ended").get<bool>()) {
      missing.push_back(fmt::format("part {} of {}, {}, did not end: {} of {} cases were checked", number, of,
                                    found->folder.string(), found->results.at("cases").size(),
                                    found->results.at("of").get<int>()));
    }
  }
  return missing;
}

/// Copies the case's folder; its name is all that results know of where it lies.
void take_files(const Json& entry, const fs::path& from_folder, const fs::path& output) {
  const fs::path name = fs::path(entry.at("files").get<std::string>()).filename();
  std::error_code none;
  fs::remove_all(output / name, none);
  if (!fs::is_directory(from_folder / name, none)) return;
  fs::copy(from_folder / name, output / name, fs::copy_options::recursive);
}

Json together(std::vector<ShardResults>& parts, const fs::path& output) {
  Json all;
  for (ShardResults& part : parts) {
    for (const Json& entry : part.results.at("cases")) take_files(entry, part.folder, output);
    if (all.is_null()) {
      all = part.results;
      continue;
    }
    // A part without pictures does not know the renderer.
    if (all.at("made_with").at("renderer") == "") all["made_with"] = part.results.at("made_with");
    all["of"] = all.at("of").get<int>() + part.results.at("of").get<int>();
    for (const char* key : {"cases", "orphans", "distances"}) {
      for (Json& item : part.results[key]) all[key].push_back(std::move(item));
    }
  }
  return all;
}

fs::path suite_here(const Json& results, const fs::path& given) {
  const fs::path file = given.empty() ? fs::path(results.at("suite").get<std::string>()) : suite_file(given);
  if (!fs::exists(file)) {
    throw Error(
        fmt::format("{}: the suite of these results is not there: name it with --suite", file.string()));
  }
  if (content_hash(read_bytes(file)) != results.at("suite_hash")) {
    throw Error(fmt::format("{} is not the suite file that was checked", file.string()));
  }
  return file;
}

}  // namespace

Json merge(const std::vector<fs::path>& shards, const fs::path& output, const fs::path& suite) {
  for (const fs::path& shard : shards) {
    std::error_code none;
    if (fs::equivalent(shard, output, none)) {
      throw Error(fmt::format("{} is what would be written to: give another --output", shard.string()));
    }
  }
  const CheckOutput place(output);
  try {
    std::vector<ShardResults> parts;
    for (const fs::path& shard : shards) parts.push_back({shard, read_results_json(shard)});
    expect_parts_of_one(parts);
    Json missing = missing_parts(parts);
    Json all = together(parts, output);
    all["suite"] = suite_here(all, suite).string();
    all["shard"] = {1, 1};
    all["ended"] = true;
    all["missing"] = std::move(missing);
    sum_up(all);
    write_results(all, output);
    write_junit(all, output);
    write_report(all, output);
    write_summary(all, output);
    return all;
  } catch (const Json::exception& error) {
    const std::string why = fmt::format("results of a shard are damaged: check it again ({})", error.what());
    place.fail(why);
    throw Error(why);
  } catch (const Error& error) {
    place.fail(error.what());
    throw;
  }
}

}  // namespace substep
