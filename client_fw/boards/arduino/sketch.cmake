# Compiles an example of the library as Arduino's IDE does it, without warnings from our sources:
#
#   cmake -DBUILDER=arduino-builder -DBOARD=arduino:avr:uno -DLIBRARY=build/arduino/Pheromone
#         -DSKETCH=UnoRadio -DMORE=FOLDER_OF_LIBRARIES -DBUILD=FOLDER -DTO=uno.elf -P sketch.cmake
#
# Debian 12's core does not compile with Debian 12's compiler by itself, since that does not define
# DECIMAL_DIG for C++11; Arduino's own tool chain needs no such option.
set(hardware /usr/share/arduino/hardware)
cmake_path(GET LIBRARY PARENT_PATH libraries)
file(REMOVE_RECURSE ${BUILD})
file(MAKE_DIRECTORY ${BUILD}/tools ${BUILD}/sketch ${BUILD}/library)
file(CREATE_LINK ${LIBRARY} ${BUILD}/library/Pheromone SYMBOLIC)  # alone, as in a user's folder
execute_process(
  COMMAND ${BUILDER} -compile -warnings=all -fqbn ${BOARD} -core-api-version 10819
          -hardware ${hardware} -hardware /usr/share/arduino-builder -tools ${BUILD}/tools
          -built-in-libraries ${hardware}/arduino/avr/libraries -libraries ${BUILD}/library
          -libraries ${MORE} -build-path ${BUILD}/sketch
          -prefs=compiler.cpp.extra_flags=-DDECIMAL_DIG=__DECIMAL_DIG__
          ${LIBRARY}/examples/${SKETCH}/${SKETCH}.ino
  RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE err)
if(NOT status EQUAL 0 OR "${out}${err}" MATCHES "Pheromone/[^\n]*warning:")
  message(FATAL_ERROR "${SKETCH} for ${BOARD}:\n${out}${err}")
endif()
file(COPY_FILE ${BUILD}/sketch/${SKETCH}.ino.elf ${TO})
