# cmake -D program=… -D source=… -D folder=… -P whole_page.cmake: `substep report` of a small sweep.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/../run_or_fail.cmake)
file(REMOVE_RECURSE ${folder})
file(WRITE ${folder}/small.toml "horizon = 0.1
properties = true
[[grid]]
scenes = [\"${source}/scenes/pendulum.gltf\", \"${source}/scenes/box_stack.gltf\"]
algorithms = [\"a1\", \"a2\", \"a3\", \"a5\"]
substeps = [1, 4]
")
run_or_fail(${program} report ${folder}/small.toml --scenes ${source}/scenes --no-cache --output ${folder}/report)
file(READ ${folder}/report/report.md page)
foreach(part IN ITEMS "12 runs of 2 scenes" "### box_stack" "## References")
  if(NOT page MATCHES "${part}")
    message(FATAL_ERROR "report.md has no '${part}'")
  endif()
endforeach()
# Every picture of the page is there, and those that need no sweep are on it.
string(REGEX MATCHALL "<figures/[a-z-]+\\.svg>" pictures "${page}")
foreach(name IN ITEMS drift mass-ratio stiffness stability ablation size)
  if(NOT "<figures/${name}.svg>" IN_LIST pictures)
    message(FATAL_ERROR "report.md does not show ${name}")
  endif()
endforeach()
foreach(picture IN LISTS pictures)
  string(REGEX REPLACE "[<>]" "" picture "${picture}")
  file(READ ${folder}/report/${picture} svg)
  if(NOT svg MATCHES "<svg")
    message(FATAL_ERROR "${picture} is no picture")
  endif()
endforeach()
file(READ ${folder}/report/report.html html)
if(NOT html MATCHES "^<!doctype html>" OR NOT html MATCHES "</html>\n$")
  message(FATAL_ERROR "report.html is no page")
endif()
