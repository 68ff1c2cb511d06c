# The project configures without cross-compilers, QEMU and libsimavr, says what it leaves out and
# why, and keeps the rest. Configures from nothing and builds nothing:
#
#   cmake -DSOURCE=. -DBUILD=build/without_tools -DGENERATOR=Ninja -DC=gcc -DCXX=g++
#         -P without_tools_test.cmake
#
# A tool is hidden by the empty path, which CMake takes for a search that has been made.
set(without_compilers -DPHEROMONE_AVR_COMPILER= -DPHEROMONE_CORTEX_M_COMPILER=
  -DPHEROMONE_ARDUINO_BUILDER=)
set(without_machines -DPHEROMONE_QEMU= -DPHEROMONE_SIMAVR_LIBRARY=)

# configure(OPTION...): `status` is CMake's exit status, `said` its words, each line joined to one.
function(configure)
  file(REMOVE_RECURSE ${BUILD})
  execute_process(
    COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} -G ${GENERATOR} -DCMAKE_C_COMPILER=${C}
            -DCMAKE_CXX_COMPILER=${CXX} ${ARGN}
    RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE err)
  string(REGEX REPLACE "[ \n]+" " " said "${out}${err}")  # CMake wraps errors
  set(status ${status} PARENT_SCOPE)
  set(said "${said}" PARENT_SCOPE)
endfunction()

function(expect_said)
  foreach(line IN LISTS ARGN)
    string(FIND "${said}" "${line}" at)
    if(at EQUAL -1)
      message(SEND_ERROR "not said: ${line}\nbut: ${said}")
    endif()
  endforeach()
endfunction()

# It configures, and `targets` says what can be built; pheromoned among it.
function(expect_configured)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "does not configure: ${said}")
  endif()
  execute_process(COMMAND ${CMAKE_COMMAND} --build ${BUILD} --target help
    OUTPUT_VARIABLE targets COMMAND_ERROR_IS_FATAL ANY)
  if(NOT targets MATCHES "pheromoned" OR NOT targets MATCHES "pheromone-swarm")
    message(SEND_ERROR "does not build the programs:\n${targets}")
  endif()
  set(targets "${targets}" PARENT_SCOPE)
endfunction()

# Nothing at all of what it takes.
configure(${without_compilers} ${without_machines})
expect_configured()
expect_said(
  "No images for the AVR: avr-g++ is not there (Debian: gcc-avr, avr-libc)"
  "No images for the CORTEX_M: arm-none-eabi-g++ is not there (Debian: gcc-arm-none-eabi)"
  "No Arduino sketches are compiled: arduino-builder or its core is not there (Debian: arduino-builder, arduino-core-avr)"
  "No simulated AVR: there are no images to run on it")
if(targets MATCHES "pheromone_client_|avr_machine|qemu_")
  message(SEND_ERROR "builds what cannot be built:\n${targets}")
endif()

# Compilers, but nothing to run images on. A compiler that only says yes will do: nothing is built.
set(any_compiler -DPHEROMONE_AVR_COMPILER=true -DPHEROMONE_CORTEX_M_COMPILER=true)
configure(${any_compiler} ${without_machines})
expect_configured()
expect_said(
  "No simulated AVR: libsimavr is not there (Debian: libsimavr-dev, libelf-dev)"
  "No tests on an emulated Cortex-M: qemu-system-arm is not there (Debian: qemu-system-arm)")
if(NOT targets MATCHES "pheromone_client_avr" OR NOT targets MATCHES "pheromone_client_cortex_m")
  message(SEND_ERROR "the images are not built:\n${targets}")
endif()

# Half of a tool chain.
configure(-DPHEROMONE_AVR_COMPILER=${CMAKE_COMMAND} ${without_machines})
expect_configured()
expect_said("No images for the AVR: ${CMAKE_COMMAND} lacks something (Debian: gcc-avr, avr-libc)")

# Not wanted, and wanted whatever happens.
configure(-DPHEROMONE_AVR=OFF -DPHEROMONE_CORTEX_M=OFF)
expect_configured()
expect_said("No images for the AVR: PHEROMONE_AVR is OFF"
            "No images for the CORTEX_M: PHEROMONE_CORTEX_M is OFF")
foreach(chip AVR CORTEX_M)
  configure(-DPHEROMONE_${chip}=ON ${without_compilers} ${without_machines})
  expect_said("PHEROMONE_${chip} is ON, but ")
  if(status EQUAL 0)
    message(SEND_ERROR "PHEROMONE_${chip}=ON configures without a compiler")
  endif()
endforeach()
file(REMOVE_RECURSE ${BUILD})
