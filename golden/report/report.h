#pragma once
/// The report of a check: one HTML file that opens from disk, with everything in it.
///
/// It needs no network and no script: without scripts it is tables and pictures, with them each pair of
/// pictures can be slid, flickered and zoomed. Pictures are in the file until it would grow beyond
/// `largest_report`; those of the cases after that are linked to where the check left them.

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>

namespace substep::golden {

constexpr std::size_t largest_report = 10'000'000;  ///< bytes

std::filesystem::path report_file(const std::filesystem::path& output);

/// From results_json(). The pictures are read from where it says.
void write_report(const nlohmann::ordered_json& results, const std::filesystem::path& output);

}  // namespace substep::golden
