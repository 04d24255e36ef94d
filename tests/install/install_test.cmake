# Installs the build to a folder, takes the C++ block after <!-- example --> from sim/README.md, builds it in a project
# of its own that knows only find_package(substep), and runs it.

include(${CMAKE_CURRENT_LIST_DIR}/../run_or_fail.cmake)

file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER}/project)

# Line by line, since CMake's lists would break the code at its semicolons.
file(READ ${README} text)
string(FIND "${text}" "<!-- example -->" start)
if(start LESS 0)
  message(FATAL_ERROR "${README}: has no <!-- example -->")
endif()
string(SUBSTRING "${text}" ${start} -1 text)
string(FIND "${text}" "```cpp\n" start)
if(start LESS 0)
  message(FATAL_ERROR "${README}: no C++ block after <!-- example -->")
endif()
math(EXPR start "${start} + 7")
string(SUBSTRING "${text}" ${start} -1 text)
string(FIND "${text}" "\n```" end)
string(SUBSTRING "${text}" 0 ${end} text)
file(WRITE ${FOLDER}/project/example.cpp "${text}\n")
file(WRITE ${FOLDER}/project/CMakeLists.txt [[
cmake_minimum_required(VERSION 3.25)
project(example LANGUAGES CXX)
find_package(substep REQUIRED)
add_executable(example example.cpp)
target_link_libraries(example PRIVATE substep::loading)
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
