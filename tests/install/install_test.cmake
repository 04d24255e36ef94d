# Installs the build to a folder, takes the C++ block after <!-- example --> from sim/README.md, builds it in a project
# of its own that knows only find_package(substep), and runs it. Links a scene that is made in code into a shared library.

include(${CMAKE_CURRENT_LIST_DIR}/../run_or_fail.cmake)

file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER}/project)

file(READ ${README} text)
if(NOT text MATCHES "<!-- example -->.*")
  message(FATAL_ERROR "${README}: has no <!-- example -->")
endif()
if(NOT CMAKE_MATCH_0 MATCHES "```cpp\n(.*)")
  message(FATAL_ERROR "${README}: no C++ block after <!-- example -->")
endif()
set(text "${CMAKE_MATCH_1}")
string(FIND "${text}" "\n```" end)
string(SUBSTRING "${text}" 0 ${end} text)
file(WRITE ${FOLDER}/project/example.cpp "${text}\n")
file(WRITE ${FOLDER}/project/CMakeLists.txt [[
cmake_minimum_required(VERSION 3.25)
project(example LANGUAGES CXX)
find_package(substep REQUIRED)
add_executable(example example.cpp)
target_link_libraries(example PRIVATE substep::loading)
add_library(made SHARED made.cpp)
target_link_libraries(made PRIVATE substep::core)
]])
file(WRITE ${FOLDER}/project/made.cpp [[
#include <vector>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"

// A type with a larger alignment would have another layout in programs that are compiled for wider vectors.
static_assert(alignof(substep::Surface) == alignof(double) && alignof(substep::Collider) == alignof(double) &&
              alignof(substep::State) == alignof(double));

substep::Simulation made();
substep::Simulation made() {
  substep::Scene scene;
  scene.bodies.resize(2);
  scene.bodies[1].inverse_mass = 1;
  scene.colliders.resize(3);
  scene.colliders[0].shape = substep::make_rectangle(10, 10, false);
  scene.colliders[1].shape = substep::make_cylinder(1, 0.5, 0);
  scene.colliders[2].shape = substep::box({1, 1, 1});
  scene.colliders[2].body = 1;
  return substep::Simulation(scene, substep::usual_settings(scene, substep::Algorithm::a5));
}
]])

run_or_fail(${CMAKE_COMMAND} --install ${BUILD} --config ${CONFIGURATION} --prefix ${FOLDER}/installed)
run_or_fail(${CMAKE_COMMAND} -S ${FOLDER}/project -B ${FOLDER}/build -G ${GENERATOR}
  -D CMAKE_BUILD_TYPE=${CONFIGURATION} -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_CXX_FLAGS=${FLAGS}
  -D CMAKE_PREFIX_PATH=${FOLDER}/installed)
run_or_fail(${CMAKE_COMMAND} --build ${FOLDER}/build --config ${CONFIGURATION})

find_program(example NAMES example PATHS ${FOLDER}/build ${FOLDER}/build/${CONFIGURATION} NO_DEFAULT_PATH REQUIRED)
run_or_fail(${example} ${SCENE})
# The rod's centre starts at the pivot's height, 1.4 m. At 0.5 s it is less than 0.1 m above its lowest point, 0.9 m.
if(NOT out MATCHES "0\\.0 s +rod +1\\.400 m" OR NOT out MATCHES "0\\.5 s +rod +0\\.9[0-9][0-9] m")
  message(FATAL_ERROR "the example prints other heights than a pendulum's:\n${out}")
endif()
