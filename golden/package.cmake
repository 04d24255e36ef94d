# Included by cpack. The package depends on the program's libraries and OSMesa, which the program loads at run time. It
# recommends the libraries of the engines' modules, and ffmpeg, which writes films.
find_program(shlibdeps dpkg-shlibdeps)
if(NOT shlibdeps)
  message(FATAL_ERROR "the package needs dpkg-shlibdeps: on Debian, apt-get install dpkg-dev")
endif()
file(GLOB modules ${CPACK_SUBSTEP_MODULES}/*.so)
list(TRANSFORM modules PREPEND -e)
# dpkg-shlibdeps must run in a folder that has debian/control.
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
