# cmake -D program=… -D source=… -D folder=… -P page_figures.cmake: compares figures with those in scenes/pictures.
include(${CMAKE_CURRENT_LIST_DIR}/../run_or_fail.cmake)
file(REMOVE_RECURSE ${folder})
file(MAKE_DIRECTORY ${folder})
run_or_fail(${program} sweep scenes/sweep.toml --no-cache --output ${folder}/sweep WORKING_DIRECTORY ${source})
run_or_fail(${program} sweep scenes/descendants.toml --no-cache --output ${folder}/descendants
  WORKING_DIRECTORY ${source})
foreach(name descendants-rows warm-start needed-substeps avbd-stability soft-rows stability
    coupled-rows)
  string(REPLACE "-" "_" file ${name})
  set(results sweep)
  if(name MATCHES "descendants|warm")
    set(results descendants)
  endif()
  run_or_fail(${program} report figure ${name} --results ${folder}/${results} --output ${folder}/${file}.svg
    WORKING_DIRECTORY ${source})
  execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${folder}/${file}.svg ${source}/scenes/pictures/${file}.svg
    RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "scenes/pictures/${file}.svg is not what 'substep report figure ${name}' draws: look at ${folder}/${file}.svg, "
      "and where the change is wanted, put it in its place")
  endif()
endforeach()
