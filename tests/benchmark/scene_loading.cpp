/// Measures the loading of scenes beside assimp alone: scene_loading FILE… prints a table in Markdown.
///
/// assimp reads the file and its buffers from the disk, as we do, with aiProcess_Triangulate, the one of its
/// steps that a loader of triangles cannot do without. It reads neither bodies nor joints, checks little and
/// makes no hulls. So the last columns give what making the scene's hulls anew, from their vertices alone and
/// equal ones once, takes, and the ratio without that.
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
#include <variant>
#include <vector>

#include "sim/geometry/convex_hull.h"
#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"

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

/// The vertices of the scene's hulls, equal ones once.
std::vector<std::vector<substep::Vector3>> hulls_of(const substep::Scene& scene) {
  std::vector<std::vector<substep::Vector3>> hulls;
  for (const substep::Collider& collider : scene.colliders) {
    const auto* hull = std::get_if<substep::Polytope>(&collider.shape);
    if (!hull || hull->box) continue;
    if (std::ranges::find(hulls, hull->vertices) == hulls.end()) hulls.push_back(hull->vertices);
  }
  return hulls;
}

void compare(const std::filesystem::path& file) {
  const auto hulls = hulls_of(substep::load_scene(file));
  std::array<double, runs> ours{};
  std::array<double, runs> theirs{};
  std::array<double, runs> hulls_alone{};
  for (std::size_t run = 0; run < runs; ++run) {
    ours[run] = time_of([&] { substep::load_scene(file); });
    theirs[run] = time_of([&] {
      Assimp::Importer importer;
      if (!importer.ReadFile(file.string(), aiProcess_Triangulate)) throw std::runtime_error("assimp cannot");
    });
    hulls_alone[run] = time_of([&] {
      for (const auto& vertices : hulls) substep::convex_hull(vertices, "benchmark");
    });
  }
  const double own = median(ours);
  const double assimp = median(theirs);
  const double hull = median(hulls_alone);
  fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {} | {:.2f} | {:.2f} |\n", file.filename().string(), assimp,
             own, own / assimp, hulls.size(), hull, (own - hull) / assimp);
}

}  // namespace

int main(int count, char** arguments) {
  fmt::print("| file | assimp [ms] | substep [ms] | ratio | hulls | hulls alone [ms] | ratio without |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  for (int i = 1; i < count; ++i) {
    const std::filesystem::path file = arguments[i];
    try {
      compare(file);
    } catch (const std::exception& error) {
      fmt::print("| {} | {} |\n", file.filename().string(), error.what());
    }
  }
}
