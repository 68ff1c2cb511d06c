# The AVR machine: libsimavr (GPL) is linked by tests and by pheromone-swarm, and only if it is there
# (../swarm/CMakeLists.txt). Includes ../boards' functions and images, so boards/ comes first.
find_path(PHEROMONE_SIMAVR_INCLUDE simavr/sim_avr.h)
find_library(PHEROMONE_SIMAVR_LIBRARY simavr)
find_library(PHEROMONE_ELF_LIBRARY elf)
set(PHEROMONE_AVR_MACHINE FALSE CACHE INTERNAL "Images for the AVR can be run")
if(NOT PHEROMONE_AVR_CXX)
  message(STATUS "No simulated AVR: there are no images to run on it")
  return()
endif()
if(NOT PHEROMONE_SIMAVR_INCLUDE OR NOT PHEROMONE_SIMAVR_LIBRARY OR NOT PHEROMONE_ELF_LIBRARY)
  set(why "libsimavr is not there (Debian: libsimavr-dev, libelf-dev)")
  if(NOT PHEROMONE_AVR STREQUAL "AUTO")
    message(FATAL_ERROR "PHEROMONE_AVR is ${PHEROMONE_AVR}, but ${why}")
  endif()
  message(STATUS "No simulated AVR: ${why}")
  return()
endif()
set(PHEROMONE_AVR_MACHINE TRUE CACHE INTERNAL "Images for the AVR can be run")

pheromone_library(client_sim_avr
  SOURCES avr/avr_bridge.cc avr/avr_eeprom.cc avr/avr_image.cc avr/avr_machine.cc avr/avr_pins.cc avr/avr_robot.cc
          avr/avr_settings.cc avr/avr_uart.cc
  LINK client_sim client_sim_pioneer)
target_include_directories(client_sim_avr SYSTEM PRIVATE ${PHEROMONE_SIMAVR_INCLUDE})
target_link_libraries(client_sim_avr
  PRIVATE ${PHEROMONE_SIMAVR_LIBRARY} ${PHEROMONE_ELF_LIBRARY})

pheromone_firmware(avr_echo_image
  COMPILER ${PHEROMONE_AVR_CXX}
  SOURCES client_fw/sim/testing/avr_echo_image.cc
  FLAGS -mmcu=atmega1284p -std=c++14 -Os -mrelax -DF_CPU=16000000UL)

pheromone_test(client_avr_machine_test RELEASED
  SOURCES avr/avr_bridge_test.cc avr/avr_machine_test.cc
  LINK client_sim_avr)
target_compile_definitions(client_avr_machine_test PRIVATE
  PHEROMONE_AVR_ECHO_IMAGE="${PHEROMONE_FIRMWARE_DIR}/avr_echo_image.elf")
add_dependencies(client_avr_machine_test avr_echo_image)
set_tests_properties(client_avr_machine_test PROPERTIES
  ENVIRONMENT ASAN_OPTIONS=detect_leaks=0)  # the simulator never frees its tables
