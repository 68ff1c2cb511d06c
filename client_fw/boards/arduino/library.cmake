# Lays out the Arduino library and packs it:
#
#   cmake [-DTO=build/arduino/Pheromone] -P client_fw/boards/arduino/library.cmake
#
# makes the folder TO and TO.zip, and needs no other build. The sources keep their paths under src/,
# which Arduino looks for includes in; .cc becomes .cpp, since it compiles nothing else. A #define in a
# sketch does not reach the library, so what the firmware's images are told by options of the compiler
# becomes the default.
cmake_minimum_required(VERSION 3.25)
cmake_path(ABSOLUTE_PATH CMAKE_CURRENT_LIST_DIR OUTPUT_VARIABLE SOURCE)
cmake_path(SET SOURCE NORMALIZE ${SOURCE}/../../..)
cmake_path(GET SOURCE PARENT_PATH SOURCE)  # without the slash at its end
if(NOT TO)
  set(TO ${SOURCE}/build/arduino/Pheromone)
endif()
file(STRINGS ${SOURCE}/CMakeLists.txt project REGEX "^project\\(pheromone VERSION")
string(REGEX MATCH "[0-9]+\\.[0-9]+\\.[0-9]+" PROJECT_VERSION "${project}")

set(boards client_fw/boards)
set(globs protocol/*.h protocol/*.cc client_fw/core/*.h client_fw/core/*.cc ${boards}/arduino/*.h
          ${boards}/arduino/*.cc)
foreach(room base medium requests signing steering)
  list(APPEND globs client_fw/core/${room}/*.h client_fw/core/${room}/*.cc)
endforeach()
list(TRANSFORM globs PREPEND ${SOURCE}/)
file(GLOB files RELATIVE ${SOURCE} ${globs})
list(APPEND files ${boards}/boot.h ${boards}/nonvolatile.h ${boards}/avr/eeprom.h)
list(FILTER files EXCLUDE REGEX "_test\\.cc$|net_record|robot_net")  # robots with nets are not part of it

# Each must be found, and once. Signed frames are 3.6 KiB, and 440 bytes of RAM: too much for an AVR whose
# robot has no key, and nothing for an ESP.
set(default_of_PHEROMONE_SIGNING "#ifdef __AVR__
#define PHEROMONE_SIGNING 0
#else
#define PHEROMONE_SIGNING 1
#endif
")
set(defaults PHEROMONE_TAGS PHEROMONE_ALL_COUNTERS PHEROMONE_ADAPTERS PHEROMONE_SIGNING)

file(REMOVE_RECURSE ${TO} ${TO}.zip)
foreach(file IN LISTS files)
  file(READ ${SOURCE}/${file} text)
  foreach(default IN LISTS defaults)
    if(text MATCHES "#define ${default} 1\n")
      if(NOT DEFINED default_of_${default})
        set(default_of_${default} "#define ${default} 0\n")
      endif()
      string(REPLACE "#define ${default} 1\n" "${default_of_${default}}" text "${text}")
      list(REMOVE_ITEM defaults ${default})
    endif()
  endforeach()
  string(REGEX REPLACE "\\.cc$" ".cpp" file "${file}")
  string(REGEX REPLACE "^${boards}/arduino/(Pheromone[A-Za-z]*\\.h)$" "\\1" file "${file}")
  file(WRITE ${TO}/src/${file} "${text}")
endforeach()
if(defaults)
  message(FATAL_ERROR "no file has a default of 1 for ${defaults}")
endif()

foreach(file library.properties library.json)
  configure_file(${SOURCE}/${boards}/arduino/${file} ${TO}/${file} @ONLY)
endforeach()
file(COPY ${SOURCE}/${boards}/arduino/examples ${SOURCE}/LICENSE DESTINATION ${TO})
cmake_path(GET TO PARENT_PATH folder)
cmake_path(GET TO FILENAME name)
execute_process(COMMAND ${CMAKE_COMMAND} -E tar cf ${name}.zip --format=zip ${name}
  WORKING_DIRECTORY ${folder} COMMAND_ERROR_IS_FATAL ANY)
message(STATUS "${TO}.zip")
