# cmake -D program=… -D scene=… -D folder=… -P slurm_test.cmake
# A sweep as a job array of a real Slurm leaves what the sweep leaves here.
file(REMOVE_RECURSE ${folder})
file(MAKE_DIRECTORY ${folder})
file(COPY ${scene} DESTINATION ${folder})
cmake_path(GET scene FILENAME name)
file(WRITE ${folder}/small.toml
  "horizon = 0.1\n[[grid]]\nscenes = [\"${name}\"]\nalgorithms = [\"a1\", \"a2\", \"a5\"]\nsubsteps = [1, 4]\n")

function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${folder} RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${text}")
  endif()
endfunction()

run(${program} sweep small.toml --output here)
run(${program} sweep small.toml --output there --slurm 3)
foreach(second RANGE 120)
  execute_process(COMMAND squeue --noheader --name=substep-sweep OUTPUT_VARIABLE waiting)
  if(waiting STREQUAL "")
    break()
  endif()
  execute_process(COMMAND ${CMAKE_COMMAND} -E sleep 1)
endforeach()
run(${program} sweep small.toml --output there --merge)
run(${CMAKE_COMMAND} -E compare_files ${folder}/here/sweep.json ${folder}/there/sweep.json)
