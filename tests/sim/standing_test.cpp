// What stands stays where it is: scenes of the library in A5, whole bodies' largest displacement over five
// seconds, and bodies that overlap from the start.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "sim/scene/scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

Scene scene_named(const std::string& name) {
  return load_scene(std::string(SUBSTEP_SOURCE_DIR) + "/scenes/" + name + ".gltf");
}

Settings settings_of(int substeps, double tau = 0.6) {
  Settings settings = default_settings(Algorithm::a5);
  settings.substeps = substeps;
  settings.tau = tau;
  return settings;
}

/// Largest displacement of any body up to `mass` in the 5 seconds, at any time, m.
double largest_displacement(const std::string& name, int substeps, double mass = 1e9) {
  const Scene scene = scene_named(name);
  Simulation simulation(scene, settings_of(substeps));
  double largest = 0;
  for (int i = 0; i < 300; ++i) {
    simulation.step();
    for (std::size_t body = 1; body < scene.bodies.size(); ++body) {
      if (scene.bodies[body].inverse_mass * mass < 1 - 1e-9) continue;
      const Vector3 moved = simulation.state().q[body].linear - scene.bodies[body].pose.position;
      largest = std::max(largest, moved.norm());
    }
  }
  return largest;
}

TEST(Standing, Probe) {
  for (const char* name : {"box_stack", "stone_pyramid", "card_house", "tall_stack", "brick_wall", "box_pyramid", "top_heavy_stack", "heavy_on_light"})
    for (const int n : {4, 10, 30}) {
      if (n == 4 && std::string(name) != "box_stack") continue;
      printf("%s %d: %.5g m", name, n, largest_displacement(name, n));
      if (std::string(name) == "heavy_on_light") printf("  up to 1000 kg %.5g", largest_displacement(name, n, 1000));
      printf("\n"); fflush(stdout);
    }
}
TEST(Standing, Overlap) {
  const Scene scene = scene_named("overlap");
  for (const int n : {1, 2, 4, 8, 16, 32, 64})
    for (const double tau : {0.3, 0.6, 1.0}) {
      Simulation simulation(scene, settings_of(n, tau));
      double fastest = 0;
      for (int i = 0; i < 300; ++i) {
        simulation.step();
        for (const Velocity& v : simulation.state().v) fastest = std::max(fastest, v.linear.norm());
      }
      printf("overlap %d %g: %.4g\n", n, tau, fastest);
    }
}

}  // namespace
}  // namespace substep
