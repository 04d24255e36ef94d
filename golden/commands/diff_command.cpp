#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include "golden/commands/commands.h"
#include "golden/compare/image_comparison.h"
#include "render/image.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/pose_table.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

struct DiffOptions {
  fs::path expected;
  fs::path actual;
  std::optional<fs::path> scene;
};

bool is_png(const fs::path& file) {
  constexpr std::string_view start = "\x89PNG";
  std::string found(start.size(), ' ');
  std::ifstream stream(file, std::ios::binary);
  return stream.read(found.data(), static_cast<std::streamsize>(found.size())) && found == start;
}

/// Prints the differences. Returns true where there are any.
bool differ(const PoseLog& expected, const PoseLog& actual) {
  const PoseDifference difference = compare(expected, actual);
  std::istringstream headers(difference.headers);
  for (std::string line; std::getline(headers, line);) fmt::print("{}\n", line);
  if (difference.first_frame < 0) {
    fmt::print("all {} frames have the same {}\n", expected.frames.size(),
               difference.first_contradiction < 0 ? "state" : "hash");
  } else {
    fmt::print("first different state: frame {} ({:g} s)\n", difference.first_frame,
               difference.first_frame * expected.settings.step);
  }
  if (difference.first_contradiction >= 0) {
    fmt::print("frame {}: other poses under one hash: one of the files was edited, or is damaged\n",
               difference.first_contradiction);
  }
  if (difference.first_full_frame >= 0) {
    const std::string where = fmt::format("first poses from there on: frame {}", difference.first_full_frame);
    if (difference.axis == ' ') {
      fmt::print("{}: equal; velocities differ\n", where);
    } else {
      const bool turned = difference.axis == 'r';
      fmt::print("{}: most in body {} {}, {}: {:.3g} {}\n", where, difference.body,
                 expected.bodies[static_cast<std::size_t>(difference.body)],
                 turned ? std::string("orientation") : fmt::format("position {}", difference.axis),
                 difference.size, turned ? "rad" : "m");
    }
  }
  if (difference.first_full_frame >= 0 || difference.first_contradiction >= 0) {
    fmt::print("largest over all poses: {:.3g} m, {:.3g} rad\n", difference.largest_position,
               difference.largest_orientation);
  }
  return !difference.none();
}

bool differ(const render::Image& expected, const render::Image& actual) {
  if (expected.width != actual.width || expected.height != actual.height) {
    fmt::print("size: {}x{} → {}x{}\n", expected.width, expected.height, actual.width, actual.height);
    return true;
  }
  const ImageComparison found = compare(expected, actual);
  if (found.judgement == Judgement::exact) {
    fmt::print("all {} pixels are equal\n", found.pixels);
    return false;
  }
  const auto count = found.above[0];
  fmt::print("{} pixels differ ({:.3g} %), by at most {} levels, at ({},{}); by {:.3g} levels in the mean\n",
             count, 100.0 * static_cast<double>(count) / static_cast<double>(found.pixels), found.max,
             found.max_x, found.max_y, found.mean);
  fmt::print("they lie in ({},{}) to ({},{})\n", found.left, found.top, found.right, found.bottom);
  fmt::print("pixels that differ by more than");
  for (std::size_t i = 0; i < ImageComparison::levels.size(); ++i) {
    fmt::print("{} {} levels: {}", i == 0 ? "" : ",", ImageComparison::levels[i], found.above[i]);
  }
  fmt::print("\nwith the goldens' tolerance: {}\n", name(found.judgement));
  return true;
}

bool differ_in_poses(const DiffOptions& options) {
  if (!options.scene) {
    for (const fs::path& file : {options.expected, options.actual}) {
      if (is_pose_table(file))
        throw Error(fmt::format("{}: name the table's scene with --scene FILE", file.string()));
    }
    return differ(read_pose_log(options.expected), read_pose_log(options.actual));
  }
  const Scene scene = load_scene(*options.scene);
  // A table has the times of the log that it is compared with.
  const auto step_of = [&](const fs::path& other) {
    return is_pose_table(other) ? scene.step : read_pose_log(other).settings.step;
  };
  return differ(read_run(options.expected, scene, step_of(options.actual)),
                read_run(options.actual, scene, step_of(options.expected)));
}

void diff(const DiffOptions& options) {
  const bool is_image = is_png(options.expected);
  // A file that is neither is reported by the reader of pose logs.
  if (is_image != is_png(options.actual) && fs::exists(options.expected) && fs::exists(options.actual)) {
    throw Error(fmt::format("{} and {}: a picture cannot be compared with anything but a picture",
                            options.expected.string(), options.actual.string()));
  }
  const bool different = is_image
                             ? differ(render::read_png(options.expected), render::read_png(options.actual))
                             : differ_in_poses(options);
  if (different) throw CLI::RuntimeError(1);
}

}  // namespace

void add_diff_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("diff", "Say what differs between two runs or two PNG files");
  const auto options = std::make_shared<DiffOptions>();
  command->add_option("expected", options->expected, "A pose log or table, or a PNG file")->required();
  command->add_option("actual", options->actual, "Another of the same kind")->required();
  command->add_option("--scene", options->scene, "The scene of a pose table");
  command->footer(
      "Ends with code 0 where nothing differs and 1 where something does.\n"
      "Example:\n  substep diff golden/poses/rod_chain/a3.poses.txt rod_chain.a3.poses.txt");
  command->callback([options] { diff(*options); });
}

}  // namespace substep::golden
