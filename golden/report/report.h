#pragma once
/// The report of a check: one HTML page that opens from disk, and junit.xml for CI services.
///
/// The page needs no network. Without scripts it is tables and pictures; with them a reader slides, flickers
/// and zooms each pair. Pictures are embedded until the page has `largest_report` bytes; further pictures,
/// and motion pages, are links into the check's folder.

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

/// Writes junit.xml: a test of each case's poses and, where it has pictures, one of its images; errors for
/// cases that could not be checked and for a check that did not end; a failure for each orphan.
void write_junit(const Json& results, const std::filesystem::path& output);

/// Writes one error for a check that could not begin or continue; `why` is its message.
void write_failed_junit(const std::string& why, const std::filesystem::path& output);

}  // namespace substep::golden
