#include "sim/study/engines/engines.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <sstream>

#include "sim/error.h"
#include "sim/measure/stepper.h"
#include "sim/measure/validity_maps.h"
#include "sim/study/engines/engine_scene.h"

namespace substep {
namespace {

/// A uniform rod of 1 m, 1 kg, on a hinge at its end, level and at rest.
Scene pendulum() {
  Scene scene = weight_on_a_joint(0, {true, true, true});
  scene.gravity = Scene().gravity;
  scene.duration = 1;
  scene.bodies[1].inverse_inertia = {5000, 12, 12};
  scene.bodies[1].pose.position = {0.5, 0, 0};
  scene.joints[0].frame_b.position = {-0.5, 0, 0};
  scene.joints[0].limits.push_back(
      {.angular = true, .axes = {true, true, false}, .min = 0, .max = 0, .stiffness = {}});
  return scene;
}

/// Compares an engine's quarter period of the pendulum with the closed form. Returns the fault; empty: none.
std::string fault_of(const MakeStepper& make, double step) {
  constexpr double quarter = 1.93333485 / 4;
  Settings settings;
  settings.step = step;
  const auto stepper = make(pendulum(), settings);
  double time = 0;
  double before = 0.5;
  while (time < 1 && stepper->step()) {
    time += settings.step;
    const double x = stepper->state().q[1].linear.x();
    if (x <= 0) {
      time -= settings.step * x / (x - before);
      break;
    }
    before = x;
  }
  const double error = std::abs(time / quarter - 1);
  if (error < 0.01) return "";
  return fmt::format("its pendulum's quarter period is {:.4f} s, {:.4f} s in closed form", time, quarter);
}

/// Returns a maker that refuses every scene where the engine fails the pendulum at a step.
MakeStepper checked(MakeStepper make, double step = 1.0 / 2000) {
  struct Check {
    std::once_flag once;
    std::string fault;
  };
  return [make = std::move(make), step, check = std::make_shared<Check>()](const Scene& scene,
                                                                           const Settings& settings) {
    std::call_once(check->once, [&] { check->fault = fault_of(make, step); });
    if (!check->fault.empty()) throw Error(check->fault);
    return make(scene, settings);
  };
}

/// A library that has one or more of the engines.
struct Library {
  const char* name;
  const char* module;   ///< file name, which the loader looks for in the program's run path
  const char* package;  ///< name in Debian 12
};
// Builds without an engine leave its line unused.
[[maybe_unused]] constexpr Library bullet{"Bullet", "substep_bullet.so", "libbullet3.24"};
[[maybe_unused]] constexpr Library ode{"ODE", "substep_ode.so", "libode8"};
[[maybe_unused]] constexpr Library mujoco{"MuJoCo", "substep_mujoco.so", "libmujoco2.2.2"};

/// Returns the module's make_engine_stepper(); the module stays loaded. Throws Error where the engine is not
/// installed.
MakeEngineStepper* find(const Library& library) {
  // Load with RTLD_LOCAL, so that the engines' symbols do not meet each other's or ours.
  void* const module = dlopen(library.module, RTLD_NOW | RTLD_LOCAL);
  void* const found = module == nullptr ? nullptr : dlsym(module, "make_engine_stepper");
  if (found == nullptr) {
    const std::string reason = dlerror();
    throw Error("{} is not installed: on Debian 12, apt-get install {} ({})", library.name, library.package,
                reason);
  }
  return reinterpret_cast<MakeEngineStepper*>(found);
}

/// Returns a maker that loads the engine on first use. Builds without engines leave it unused.
[[maybe_unused]] MakeStepper loaded(const Library& library, const char* solver,
                                    bool has_filters_and_motion = false) {
  return checked([&library, solver, has_filters_and_motion](const Scene& scene, const Settings& settings) {
    MakeEngineStepper* const make = find(library);
    return std::unique_ptr<Stepper>(
        make(scene, engine_scene(scene, has_filters_and_motion), settings, solver));
  });
}

/// Returns the folder of the adapters: the installed program's, or the source's.
std::filesystem::path adapters() {
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  const auto installed = program.parent_path() / SUBSTEP_INSTALLED_ADAPTERS;
  if (std::filesystem::exists(installed / "adapter.mjs", ignored)) return installed.lexically_normal();
  return SUBSTEP_ADAPTERS;
}

bool is_in_path(const char* program) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  std::error_code ignored;
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (std::filesystem::exists(std::filesystem::path(folder) / program, ignored)) return true;
  }
  return false;
}

/// Returns an engine from npm, which runs under Node through the adapter "NAME.mjs".
Engine node_engine(const char* name, const char* label, const char* settings, const char* package,
                   bool has_iterations) {
  const MakeStepper make = [=](const Scene& scene, const Settings& given) {
    const std::filesystem::path folder = adapters();
    if (!is_in_path("node") || !std::filesystem::exists(folder / "node_modules" / package)) {
      throw Error("{} is not installed: with Node 18 or later, npm ci --prefix {}", label, folder.string());
    }
    const std::string adapter = (folder / fmt::format("{}.mjs", name)).string();
    return recorded_stepper(run_command({"node", adapter, "{scene}", "{settings}", "{poses}"}, scene, given));
  };
  return {name, label, settings, false, checked(make, 1.0 / 500), has_iterations, true};
}

std::vector<Engine> built() {
  std::vector<Engine> all;
  for (const int order : {4, 8}) {
    all.push_back(
        {fmt::format("order-{}", order), fmt::format("own, order {}", order),
         fmt::format(
             "the accurate mode: constraints at acceleration level, {}, projected back after each step",
             order == 4 ? "Runge-Kutta" : "extrapolated midpoint rule"),
         true, checked([order](const Scene& scene, const Settings& settings) {
           return reference_stepper(scene, settings.step, order);
         })});
  }
#ifdef SUBSTEP_BULLET_VERSION
  all.push_back({"bullet-si", "Bullet " SUBSTEP_BULLET_VERSION " SI",
                 "warm starting, split impulse, ERP 0.2 as it ships", false, loaded(bullet, "SI", true),
                 true});
  all.push_back({"bullet-dantzig", "Bullet " SUBSTEP_BULLET_VERSION " Dantzig", "MLCP by Dantzig's method",
                 false, loaded(bullet, "Dantzig", true)});
#endif
#ifdef SUBSTEP_ODE_VERSION
  all.push_back({"ode-step", "ODE " SUBSTEP_ODE_VERSION " dWorldStep", "ERP 0.2, CFM as it ships", false,
                 loaded(ode, "step")});
  all.push_back({"ode-quickstep", "ODE " SUBSTEP_ODE_VERSION " QuickStep", "ERP 0.2, CFM as it ships", false,
                 loaded(ode, "QuickStep"), true});
#endif
#ifdef SUBSTEP_MUJOCO_VERSION
  all.push_back({"mujoco-euler", "MuJoCo " SUBSTEP_MUJOCO_VERSION " Euler",
                 "reduced coordinates, soft contacts as it ships", false, loaded(mujoco, "Euler")});
  all.push_back({"mujoco-rk4", "MuJoCo " SUBSTEP_MUJOCO_VERSION " RK4",
                 "reduced coordinates, Runge-Kutta, soft contacts as it ships", false,
                 loaded(mujoco, "RK4")});
#endif
  all.push_back(node_engine("rapier", "Rapier 0.21", "solver iterations, all else as it ships",
                            "@dimforge/rapier3d-compat", true));
  all.back().iterations_are_substeps = true;
  all.push_back(node_engine("jolt", "Jolt 1.1", "velocity steps, no damping, all else as it ships",
                            "jolt-physics", true));
  all.push_back(node_engine("mujoco3", "MuJoCo 3.14",
                            "Euler, reduced coordinates, soft contacts, all as it ships", "@mujoco/mujoco",
                            false));
  return all;
}

}  // namespace

const std::vector<Engine>& engines() {
  static const std::vector<Engine> all = built();
  return all;
}

const Engine* find_engine(std::string_view name) {
  const auto found = std::ranges::find(engines(), name, &Engine::name);
  return found == engines().end() ? nullptr : &*found;
}

bool is_engine_name(std::string_view name) {
  // List those that a build may lack.
  constexpr std::array<std::string_view, 6> optional{"bullet-si",     "bullet-dantzig", "ode-step",
                                                     "ode-quickstep", "mujoco-euler",   "mujoco-rk4"};
  return find_engine(name) != nullptr || std::ranges::find(optional, name) != optional.end();
}

std::string engine_names() {
  std::string names;
  for (const Engine& engine : engines()) names += (names.empty() ? "" : ", ") + engine.name;
  return names;
}

}  // namespace substep
