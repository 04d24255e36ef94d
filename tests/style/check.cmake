# cmake -D source=… -D tool=clang-format|clang-tidy [-D build=…] -P check.cmake. Fails where the tool finds a fault.
find_program(program NAMES ${tool} ${tool}-14)
if(NOT program)
  message(FATAL_ERROR "${tool} is missing: on Debian, apt-get install ${tool}")
endif()
file(GLOB_RECURSE files ${source}/sim/*.cpp ${source}/render/*.cpp ${source}/golden/*.cpp ${source}/scenes/*.cpp
  ${source}/tests/*.cpp)
if(tool STREQUAL "clang-format")
  file(GLOB_RECURSE headers ${source}/sim/*.h ${source}/render/*.h ${source}/golden/*.h ${source}/scenes/*.h
    ${source}/tests/*.h)
  execute_process(COMMAND ${program} --dry-run --Werror ${files} ${headers} RESULT_VARIABLE result
    OUTPUT_VARIABLE text ERROR_VARIABLE text)
else()
  # Generate compile commands of single sources: the build joins several and precompiles headers.
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${source} -B ${build}/tidy -G Ninja -D SUBSTEP_SOURCES_AT_ONCE=OFF
    -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${program} --quiet -p ${build}/tidy ${files} RESULT_VARIABLE result OUTPUT_VARIABLE text
    ERROR_VARIABLE ignored)
endif()
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${tool}:\n${text}")
endif()
