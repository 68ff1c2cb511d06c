# Images for microcontrollers out of the ordinary build, without a word of the host's flags.
#
#   pheromone_cross_compiler(AVR avr-g++ "gcc-avr, avr-libc" -mmcu=atmega1284p -include avr/io.h)
#   if(PHEROMONE_AVR_CXX)
#     pheromone_firmware(NAME COMPILER ${PHEROMONE_AVR_CXX} SOURCES a.cc b.cc FLAGS -Os ... LINK ...)
#   endif()
#
# builds firmware/NAME.elf and NAME.hex in the build directory with the rest of it, and prints the
# size. Compiled and linked in two steps: avr-gcc 5.4 crashes when -flto and -MMD meet in one.

# pheromone_cross_compiler(CHIP COMPILER PACKAGES FLAG...): PHEROMONE_<CHIP>_CXX is the compiler, or
# false, which is said with the reason, everywhere from then on. The cache variable PHEROMONE_<CHIP>
# may be OFF, or ON, which makes the reason an error.
function(pheromone_cross_compiler chip compiler packages)
  set(PHEROMONE_${chip} AUTO CACHE STRING
    "Images for the ${chip} and the tests that run them: AUTO (if possible), ON, OFF")
  set_property(CACHE PHEROMONE_${chip} PROPERTY STRINGS AUTO ON OFF)
  set(wanted ${PHEROMONE_${chip}})
  set(PHEROMONE_${chip}_CXX FALSE CACHE INTERNAL "")
  if(NOT wanted STREQUAL "AUTO" AND NOT wanted)
    message(STATUS "No images for the ${chip}: PHEROMONE_${chip} is ${wanted}")
    return()
  endif()
  find_program(PHEROMONE_${chip}_COMPILER ${compiler})
  set(why "")
  if(NOT PHEROMONE_${chip}_COMPILER)
    set(why "${compiler} is not there (Debian: ${packages})")
  else()
    execute_process(COMMAND ${PHEROMONE_${chip}_COMPILER} ${ARGN} -x c++ -fsyntax-only /dev/null
      RESULT_VARIABLE status OUTPUT_QUIET ERROR_QUIET)
    if(NOT status EQUAL 0)
      set(why "${PHEROMONE_${chip}_COMPILER} lacks something (Debian: ${packages})")
    endif()
  endif()
  if(why STREQUAL "")
    set(PHEROMONE_${chip}_CXX ${PHEROMONE_${chip}_COMPILER} CACHE INTERNAL "")
  elseif(wanted STREQUAL "AUTO")
    message(STATUS "No images for the ${chip}: ${why}")
  else()
    message(FATAL_ERROR "PHEROMONE_${chip} is ${wanted}, but ${why}")
  endif()
endfunction()

# pheromone_cross_tool(VARIABLE COMPILER NAME): the tool of binutils that belongs to a compiler,
# "arm-none-eabi-size" beside "arm-none-eabi-g++".
function(pheromone_cross_tool variable compiler name)
  string(REGEX REPLACE "g\\+\\+$" "${name}" tool "${compiler}")
  set(${variable} ${tool} PARENT_SCOPE)
endfunction()

# pheromone_firmware(name COMPILER path SOURCES file... FLAGS flag... [LINK flag...]
#                    [LINK_DEPENDS file...])
# Sources are relative to the project's root. PHEROMONE_FIRMWARE_DIR is where the images go.
set(PHEROMONE_FIRMWARE_DIR ${CMAKE_BINARY_DIR}/firmware CACHE INTERNAL "")
function(pheromone_firmware name)
  cmake_parse_arguments(arg "" "COMPILER" "SOURCES;FLAGS;LINK;LINK_DEPENDS" ${ARGN})
  list(APPEND arg_FLAGS
    -fno-exceptions -fno-rtti -fno-threadsafe-statics -ffunction-sections -fdata-sections
    -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow)
  if(PHEROMONE_WERROR)
    list(APPEND arg_FLAGS -Werror)
  endif()
  pheromone_cross_tool(objcopy ${arg_COMPILER} objcopy)
  pheromone_cross_tool(size ${arg_COMPILER} size)
  set(elf ${PHEROMONE_FIRMWARE_DIR}/${name}.elf)
  set(hex ${PHEROMONE_FIRMWARE_DIR}/${name}.hex)

  set(objects)
  foreach(source IN LISTS arg_SOURCES)
    set(object ${PHEROMONE_FIRMWARE_DIR}/${name}.dir/${source}.o)
    cmake_path(GET object PARENT_PATH folder)
    add_custom_command(OUTPUT ${object}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${folder}
      COMMAND ${arg_COMPILER} ${arg_FLAGS} -I${PROJECT_SOURCE_DIR} -MMD -MT ${object}
              -MF ${object}.d -c ${PROJECT_SOURCE_DIR}/${source} -o ${object}
      DEPENDS ${PROJECT_SOURCE_DIR}/${source}
      DEPFILE ${object}.d
      COMMENT "Compiling ${source} for ${name}"
      VERBATIM)
    list(APPEND objects ${object})
  endforeach()
  add_custom_command(OUTPUT ${elf} ${hex}
    COMMAND ${arg_COMPILER} ${arg_FLAGS} ${objects} -Wl,--gc-sections ${arg_LINK} -o ${elf}
    COMMAND ${objcopy} -O ihex -R .eeprom ${elf} ${hex}
    COMMAND ${size} ${elf}
    DEPENDS ${objects} ${arg_LINK_DEPENDS}
    COMMENT "Linking ${name}.elf"
    VERBATIM)
  # No sanitizer of the host sees what is in them: there, only those are built that a test asks for.
  if(PHEROMONE_SANITIZE)
    add_custom_target(${name} DEPENDS ${elf} ${hex})
  else()
    add_custom_target(${name} ALL DEPENDS ${elf} ${hex})
  endif()
endfunction()

# pheromone_runs_image(test image...): for tests labelled "conformance" or "elsewhere", which no
# sanitizer watches.
function(pheromone_runs_image test)
  if(NOT PHEROMONE_SANITIZE)
    add_dependencies(${test} ${ARGN})
  endif()
endfunction()
