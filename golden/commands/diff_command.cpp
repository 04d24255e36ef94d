#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "golden/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/error.h"
#include "sim/log/pose_table.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

struct DiffOptions {
  fs::path expected;
  fs::path actual;
  std::optional<fs::path> scene;
  SceneOptions mesh;
};

/// Prints the differences. Returns true if there are any.
bool differ(const PoseLog& expected, const PoseLog& actual) {
  if (expected.settings.step != actual.settings.step) {
    throw Error("the runs' steps are {:g} s and {:g} s: compare their tables ('run --csv')",
                expected.settings.step, actual.settings.step);
  }
  const PoseDifference difference = compare(expected, actual);
  if (!difference.headers.empty()) fmt::print("{}\n", difference.headers);
  if (difference.first_frame < 0) {
    fmt::print("all {} frames have the same {}\n", expected.frames.size(),
               difference.first_contradiction < 0 ? "state" : "hash");
  } else {
    fmt::print("first different state: frame {} ({:g} s)\n", difference.first_frame,
               difference.first_frame * expected.settings.step);
  }
  if (difference.first_contradiction >= 0) {
    fmt::print("frame {}: different poses with the same hash: one of the files was edited or is damaged\n",
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

bool logs_differ(const DiffOptions& options) {
  if (!options.scene) {
    for (const fs::path& file : {options.expected, options.actual}) {
      if (is_pose_table(file)) throw Error("{}: name the table's scene with --scene FILE", file.string());
    }
    return differ(read_pose_log(options.expected), read_pose_log(options.actual));
  }
  const Scene scene = options.mesh.load(*options.scene);
  // A table has the times of the log that it is compared with.
  const auto step_of = [&](const fs::path& other) {
    return is_pose_table(other) ? scene.step : read_pose_log(other).settings.step;
  };
  const PoseLog expected = read_run(options.expected, scene, step_of(options.actual));
  PoseLog actual = read_run(options.actual, scene, step_of(options.expected));
  // The author of a table is the file's name.
  if (is_pose_table(options.expected) && is_pose_table(options.actual)) actual.author = expected.author;
  return differ(expected, actual);
}

}  // namespace

void add_diff_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("diff", "Report the differences between two runs");
  const auto options = std::make_shared<DiffOptions>();
  command->add_option("expected", options->expected, "A pose log or table")->required();
  command->add_option("actual", options->actual, "Another pose log or table")->required();
  command->add_option("--scene", options->scene, "The scene of a pose table");
  options->mesh.add_mesh_options_to(*command);
  command->footer(
      "Ends with code 0 where nothing differs and 1 where something does.\n"
      "Example:\n  substep diff golden/poses/rod_chain/a3.poses rod_chain.a3.poses.txt");
  command->callback([options] {
    if (logs_differ(*options)) throw CLI::RuntimeError(1);
  });
}

}  // namespace substep::golden
