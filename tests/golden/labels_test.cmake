# cmake -D program=… -D source=… -D folder=… -P labels_test.cmake: a film's frame and a contact sheet, with all that is
# written on them, byte for byte. The suite's pictures have no words, so that a label a pixel off would pass there.
include(${CMAKE_CURRENT_LIST_DIR}/../run_or_fail.cmake)

file(MAKE_DIRECTORY ${folder})
set(scenes ${source}/scenes)
run_or_fail(${program} render ${scenes}/pendulum.gltf ${scenes}/box_stack.gltf --layout sheet --size 160x90 --columns 2
  --algorithm a1 --output ${folder}/sheet.png)
run_or_fail(${program} video ${scenes}/pendulum.gltf --size 640x360 --substeps 2 --duration 0.1 --hold 0
  --frames ${folder}/frames)
file(RENAME ${folder}/frames/frame_0002.png ${folder}/film.png)
foreach(picture sheet film)
  set(golden ${source}/tests/golden/labels/${picture}.png)
  execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${golden} ${folder}/${picture}.png RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(SEND_ERROR "Look at ${folder}/${picture}.png; if it is right, copy it over ${golden}.")
  endif()
endforeach()
