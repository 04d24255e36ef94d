#pragma once
/// The report of a check: one HTML file that opens from disk, with everything in it; and junit.xml for CI
/// services.
///
/// The page needs no network and no script: without scripts it is tables and pictures, with them each pair of
/// pictures can be slid, flickered and zoomed. Pictures are in the file until it would grow beyond
/// `largest_report`; later cases link to their pictures in the check's folder.

#include <cstddef>
#include <filesystem>
#include <string>

#include "sim/loading/json_value.h"

namespace substep::golden {

constexpr std::size_t largest_report = 10'000'000;  ///< bytes

std::filesystem::path report_file(const std::filesystem::path& output);

/// Writes the report of results.json, and reads the pictures that it names.
void write_report(const Json& results, const std::filesystem::path& output);

std::filesystem::path junit_file(const std::filesystem::path& output);

/// Writes junit.xml with two tests a case, poses and images. A case that could not be checked is an error; so
/// are all cases left over by a check that did not end.
void write_junit(const Json& results, const std::filesystem::path& output);

/// Writes one error for a check that could not begin or continue; `why` is its message.
void write_failed_junit(const std::string& why, const std::filesystem::path& output);

}  // namespace substep::golden
