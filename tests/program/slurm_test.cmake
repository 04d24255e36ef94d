# cmake -D program=… -D scene=… -D folder=… -P slurm_test.cmake
# Checks that a sweep run as a Slurm job array writes the same sweep.json as a local run.
include(${CMAKE_CURRENT_LIST_DIR}/../run_or_fail.cmake)
file(REMOVE_RECURSE ${folder})
file(MAKE_DIRECTORY ${folder})
file(COPY ${scene} DESTINATION ${folder})
cmake_path(GET scene FILENAME name)
file(WRITE ${folder}/small.toml
  "horizon = 0.1\n[[grid]]\nscenes = [\"${name}\"]\nalgorithms = [\"a1\", \"a2\", \"a5\"]\nsubsteps = [1, 4]\n")

run_or_fail(${program} sweep small.toml --output here WORKING_DIRECTORY ${folder})
run_or_fail(${program} sweep small.toml --output there --slurm 3 WORKING_DIRECTORY ${folder})
foreach(second RANGE 120)
  execute_process(COMMAND squeue --noheader --name=substep-sweep OUTPUT_VARIABLE waiting)
  if(waiting STREQUAL "")
    break()
  endif()
  execute_process(COMMAND ${CMAKE_COMMAND} -E sleep 1)
endforeach()
run_or_fail(${program} sweep small.toml --output there --merge WORKING_DIRECTORY ${folder})
run_or_fail(${CMAKE_COMMAND} -E compare_files ${folder}/here/sweep.json ${folder}/there/sweep.json)
