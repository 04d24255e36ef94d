#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "sim/commands/commands.h"
#include "sim/commands/csv_lines.h"
#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/measure/metrics_text.h"
#include "sim/measure/motion.h"

namespace substep {
namespace {

struct ReferenceOptions {
  SceneOptions scene;
  std::filesystem::path csv;
  std::optional<std::string> duration;
};

std::string table_of(const Scene& scene, const ReferenceMotion& reference) {
  std::string text = fmt::format("{},position_uncertainty,turn_uncertainty\n", csv_columns);
  for (std::size_t k = 0; k < reference.uncertainties.size(); ++k) {
    const Uncertainty& uncertainty = reference.uncertainties[k];
    text += csv_lines(scene, reference.motion.samples[k], static_cast<double>(k) * reference.motion.interval,
                      fmt::format(",{:.3g},{:.3g}", uncertainty.position, uncertainty.turn));
  }
  return text;
}

void write_reference(const ReferenceOptions& options) {
  const Scene scene = options.scene.load();
  note_cost_of_a1(scene);
  const double duration = options.duration ? seconds_in(*options.duration, "--duration") : scene.duration;
  if (!(duration >= scene.step && duration <= 3600)) {
    throw Error(
        fmt::format("duration {:g} s: from the scene's step, {:g} s, to 3600 s", duration, scene.step));
  }
  require_folder_of(options.csv);
  options.scene.require_separate({{"--csv", options.csv}});
  ReferenceMotion reference;
  {
    Progress progress;
    progress.show("reference", 0);
    reference = reference_motion(scene, duration);
  }
  if (reference.horizon == 0) {
    fmt::print(stderr,
               "substep: {}: no reference: {} and half its steps part at once, at {}; nothing is written\n",
               scene.name, reference.method, reference.divergence_point);
    throw CLI::RuntimeError(1);
  }
  write_file(options.csv, table_of(scene, reference));
  fmt::print("{}: {}\nwrote {}\n", scene.name, reference_text(reference), options.csv.string());
  if (reference.horizon < duration - scene.step / 2) {
    fmt::print("nothing is known, and written, of the {:g} s after that\n", duration - reference.horizon);
  }
}

}  // namespace

void add_reference_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "reference", "Write a scene's motion without a step's error, as a table, with its uncertainty");
  const auto options = std::make_shared<ReferenceOptions>();
  options->scene.add_to(*command);
  command->add_option("--csv", options->csv, "The table")->required();
  command->add_option("--duration", options->duration, "Seconds")->default_str("the scene's");
  command->footer(
      "Scenes without contacts: by an integrator of order 12 in which joints hold to rounding. With "
      "contacts: by\n"
      "A1 at steps halved again and again, extrapolated to step zero. What was used is said at the end.\n"
      "A line a step of the scene and body: as 'run --csv' writes, and by how much any body may be off "
      "until\n"
      "then (m, rad). The table ends where refinements part by 2e-5 of the scene's size; where they do so "
      "at\n"
      "once nothing is written, and the code is 1.\n"
      "Example:\n  substep reference scenes/rod_chain.gltf --csv rod_chain.csv --duration 2");
  command->callback([options] { write_reference(*options); });
}

}  // namespace substep
