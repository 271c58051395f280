# Installs the library below the build folder, and builds and runs examples/03_consumer_cmake against it.
# Needs: BUILD, EXAMPLE, COMPILER, FLAGS, BUILD_TYPE; to cross-compile: TOOLCHAIN, EMULATOR
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "failed (${code}): ${ARGV}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(prefix ${BUILD}/consumer/installed)
file(REMOVE_RECURSE ${BUILD}/consumer)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --component development)
set(options -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS}
  -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_TOOLCHAIN_FILE=${TOOLCHAIN})
set(variants "")
if(NOT TOOLCHAIN)
  set(variants " -march=native")  # with AVX, Eigen would align more than in the library
endif()
foreach(more IN ITEMS "" ${variants})
  run(${CMAKE_COMMAND} -S ${EXAMPLE} -B ${BUILD}/consumer/build -G Ninja ${options} "-DCMAKE_CXX_FLAGS=${FLAGS}${more}")
  run(${CMAKE_COMMAND} --build ${BUILD}/consumer/build)
  run(${EMULATOR} ${BUILD}/consumer/build/consumer)
  if(NOT output MATCHES "after 5.0 s at 11.[0-9] m, 0.[0-9] m: [0-9]+ modes")
    message(FATAL_ERROR "the consumer said: ${output}")
  endif()
endforeach()

# To configure it for another component finds all that this one needs.
foreach(part IN ITEMS io service)
  file(READ ${EXAMPLE}/CMakeLists.txt project)
  string(REPLACE core ${part} project "${project}")
  file(WRITE ${BUILD}/consumer/${part}/CMakeLists.txt "${project}")
  file(COPY ${EXAMPLE}/main.cpp DESTINATION ${BUILD}/consumer/${part})
  run(${CMAKE_COMMAND} -S ${BUILD}/consumer/${part} -B ${BUILD}/consumer/${part}/build -G Ninja ${options})
endforeach()
