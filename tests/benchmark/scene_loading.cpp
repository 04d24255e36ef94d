/// Measures the loading of scenes beside assimp alone: scene_loading FILE… prints a table in Markdown.
///
/// assimp reads the file and its buffers from the disk, as we do, with aiProcess_Triangulate, the one of its
/// steps that a loader of triangles cannot do without. It reads neither bodies nor joints, checks little and
/// makes no hulls.
///
/// Medians of 31 runs in processor time, one of each in turn, so that a busy machine slows all alike.

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <stdexcept>

#include "sim/loading/load_scene.h"

namespace {

constexpr std::size_t runs = 31;

/// Milliseconds of processor time.
template <typename Function>
double time_of(const Function& function) {
  const std::clock_t start = std::clock();
  function();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

double median(std::array<double, runs>& times) {
  std::ranges::nth_element(times, times.begin() + runs / 2);
  return times[runs / 2];
}

void compare(const std::filesystem::path& file) {
  std::array<double, runs> ours{};
  std::array<double, runs> theirs{};
  for (std::size_t run = 0; run < runs; ++run) {
    ours[run] = time_of([&] { substep::load_scene(file); });
    theirs[run] = time_of([&] {
      Assimp::Importer importer;
      if (!importer.ReadFile(file.string(), aiProcess_Triangulate)) throw std::runtime_error("assimp cannot");
    });
  }
  const double own = median(ours);
  const double assimp = median(theirs);
  fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} |\n", file.filename().string(), assimp, own, own / assimp);
}

}  // namespace

int main(int count, char** arguments) {
  fmt::print("| file | assimp [ms] | substep [ms] | ratio |\n|---|---|---|---|\n");
  for (int i = 1; i < count; ++i) {
    const std::filesystem::path file = arguments[i];
    try {
      compare(file);
    } catch (const std::exception& error) {
      fmt::print("| {} | {} |\n", file.filename().string(), error.what());
    }
  }
}
