# Compiles an example of the library as Arduino's IDE does it, without warnings from our sources:
#
#   cmake -DSKETCH=UnoRadio -DBOARD=arduino:avr:uno [-DLIBRARY=build/arduino/Pheromone]
#         [-DBUILD=build/arduino/UnoRadio] [-DTO=uno.elf] [-DFLAGS=-DPHEROMONE_SIGNING=1]
#         -P client_fw/boards/arduino/sketch.cmake
#
# FLAGS are for all files, those of the library too.
#
# Debian 12's core does not compile with Debian 12's compiler by itself, since that does not define
# DECIMAL_DIG for C++11; Arduino's own tool chain needs no such option.
cmake_minimum_required(VERSION 3.25)
if(NOT LIBRARY)
  set(LIBRARY ${CMAKE_CURRENT_LIST_DIR}/../../../build/arduino/Pheromone)
endif()
if(NOT BUILD)
  set(BUILD ${LIBRARY}/../${SKETCH})
endif()
cmake_path(NORMAL_PATH LIBRARY)
cmake_path(NORMAL_PATH BUILD)
set(hardware /usr/share/arduino/hardware)
file(REMOVE_RECURSE ${BUILD})
file(MAKE_DIRECTORY ${BUILD}/tools ${BUILD}/sketch ${BUILD}/library)
file(CREATE_LINK ${LIBRARY} ${BUILD}/library/Pheromone SYMBOLIC)  # alone, as in a user's folder
execute_process(
  COMMAND arduino-builder -compile -warnings=all -fqbn ${BOARD} -core-api-version 10819
          -hardware ${hardware} -hardware /usr/share/arduino-builder -tools ${BUILD}/tools
          -built-in-libraries ${hardware}/arduino/avr/libraries -libraries ${BUILD}/library
          -libraries ${CMAKE_CURRENT_LIST_DIR}/testing/libraries -build-path ${BUILD}/sketch
          "-prefs=compiler.cpp.extra_flags=-DDECIMAL_DIG=__DECIMAL_DIG__ ${FLAGS}"
          ${LIBRARY}/examples/${SKETCH}/${SKETCH}.ino
  RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE err)
if(NOT status EQUAL 0 OR "${out}${err}" MATCHES "Pheromone/[^\n]*warning:")
  message(FATAL_ERROR "${SKETCH} for ${BOARD}:\n${out}${err}")
endif()
if(TO)
  file(COPY_FILE ${BUILD}/sketch/${SKETCH}.ino.elf ${TO})
endif()
message(STATUS "${BUILD}/sketch/${SKETCH}.ino.hex")
