# cmake -D program=… -D source=… -D build=… -D compiler=… -D body_steps=… -P same_bits.cmake
#
# Fails where the state hashes of a scene in scenes/, published/ left out, differ between `program` and
# - itself, with AVX2 and FMA hidden from the C library,
# - the same source, built with `compiler` at -O1.

include(${CMAKE_CURRENT_LIST_DIR}/../run_or_fail.cmake)
file(GLOB scenes ${source}/scenes/*.gltf)

function(hashes result)
  run_or_fail(${ARGN} ${body_steps} ${scenes})
  string(LENGTH "${out}" length)
  if(length LESS 1000)
    message(FATAL_ERROR "${ARGN} printed too little: ${out}")
  endif()
  set(${result} "${out}" PARENT_SCOPE)
endfunction()

hashes(here ${program})
hashes(older ${CMAKE_COMMAND} -E env GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-AVX ${program})
if(NOT here STREQUAL older)
  message(FATAL_ERROR "other bits without AVX2 and FMA:\n${here}\n--- and\n${older}")
endif()

run_or_fail(${CMAKE_COMMAND} -S ${source} -B ${build} -G Ninja -D CMAKE_CXX_COMPILER=${compiler}
  -D CMAKE_BUILD_TYPE=None -D CMAKE_CXX_FLAGS=-O1 -D SUBSTEP_BENCHMARKS=OFF)
run_or_fail(${CMAKE_COMMAND} --build ${build} --target pose_hashes)
hashes(other ${build}/tests/reproducibility/pose_hashes)
if(NOT here STREQUAL other)
  message(FATAL_ERROR "other bits from ${compiler} -O1:\n${here}\n--- and\n${other}")
endif()
message(STATUS "the same bits: ${compiler} -O1, and without AVX2 and FMA")
