/// How long scenes take to load beside assimp alone, which reads neither bodies nor checks anything:
/// scene_loading FILE… prints both for each file, the median of 21 runs in processor
/// time, and their ratio.

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

#include "sim/scene/scene.h"

namespace {

/// Milliseconds of processor time.
template <typename Function>
double median_time(const Function& function) {
  std::array<double, 21> times{};
  for (double& time : times) {
    const std::clock_t start = std::clock();
    function();
    time = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  }
  std::ranges::nth_element(times, times.begin() + times.size() / 2);
  return times[times.size() / 2];
}

}  // namespace

int main(int count, char** arguments) {
  fmt::print("{:<36}{:>12}{:>12}{:>8}\n", "", "ours [ms]", "assimp [ms]", "ratio");
  for (int i = 1; i < count; ++i) {
    const std::filesystem::path file = arguments[i];
    try {
      const double ours = median_time([&] { substep::load_scene(file); });
      const double assimp = median_time([&] {
        Assimp::Importer importer;
        if (!importer.ReadFile(file.string(), aiProcess_Triangulate))
          throw std::runtime_error("assimp cannot");
      });
      fmt::print("{:<36}{:>12.2f}{:>12.2f}{:>8.2f}\n", file.filename().string(), ours, assimp, ours / assimp);
    } catch (const std::exception& error) {
      fmt::print("{:<36}{}\n", file.filename().string(), error.what());
    }
  }
}
