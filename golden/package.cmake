# cpack includes this: the package depends on the libraries of the program, and recommends those of the engines' modules,
# without which all but the engines run. OSMesa, too, is loaded by name, but without it nothing is drawn.
find_program(shlibdeps dpkg-shlibdeps)
if(NOT shlibdeps)
  message(FATAL_ERROR "the package needs dpkg-shlibdeps: on Debian, apt-get install dpkg-dev")
endif()
file(GLOB modules ${CPACK_SUBSTEP_MODULES}/*.so)
list(TRANSFORM modules PREPEND -e)
# It wants to stand in the folder of a package's sources.
set(folder ${CPACK_PACKAGE_DIRECTORY}/shlibdeps)
file(WRITE ${folder}/debian/control "")
execute_process(COMMAND ${shlibdeps} -O --ignore-missing-info -e${CPACK_SUBSTEP_PROGRAM} -dRecommends ${modules}
  WORKING_DIRECTORY ${folder} RESULT_VARIABLE result OUTPUT_VARIABLE found ERROR_VARIABLE fault)
file(REMOVE_RECURSE ${folder})
if(NOT result EQUAL 0 OR NOT found MATCHES "shlibs:Depends=([^\n]*)")
  message(FATAL_ERROR "${shlibdeps}: ${result}\n${found}\n${fault}")
endif()
set(CPACK_DEBIAN_PACKAGE_DEPENDS "${CMAKE_MATCH_1}, libosmesa6")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS ffmpeg)
if(found MATCHES "shlibs:Recommends=([^\n]*)")
  string(APPEND CPACK_DEBIAN_PACKAGE_RECOMMENDS ", ${CMAKE_MATCH_1}")
endif()
