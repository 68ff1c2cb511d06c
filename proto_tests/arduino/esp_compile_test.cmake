# The library and its examples for ESPs compile for their processors, most of it to the syntax: an ESP8266's Xtensa LX106, and
# the RV32IMC of ESP32-C3 and -C6, against stand-ins for the headers of their cores.
#
#   cmake -DLIBRARY=build/arduino/Pheromone -DSHIM=shim -DLX106=xtensa-lx106-elf-g++
#         -DRV32=riscv64-unknown-elf-g++ -DKEY=client_fw/boards/arduino/testing/key -DTO=build/arduino/esp
#         -P esp_compile_test.cmake
#
# Arduino compiles the first as gnu++17, the second as gnu++2b, of which these compilers know most.
set(flags -Os -Wall -Wextra -Werror -ffreestanding -fno-exceptions -fno-rtti -fno-threadsafe-statics
  -DARDUINO=10819 -isystem ${SHIM} -I${LIBRARY}/src)
file(GLOB_RECURSE sources ${LIBRARY}/src/*.cpp)
file(MAKE_DIRECTORY ${TO})
foreach(chip LX106 RV32)
  set(chip_LX106 ${LX106} -DESP8266 -std=gnu++17 -mlongcalls)
  set(chip_RV32 ${RV32} -DESP32 -std=gnu++2b -march=rv32imc -mabi=ilp32)
  foreach(source IN LISTS sources)
    if(NOT source MATCHES "facade")  # which has the robot itself
      set(flags_here ${flags} -fsyntax-only)
    else()
      set(flags_here ${flags} -c -o ${TO}/${chip}.o)
    endif()
    execute_process(COMMAND ${chip_${chip}} ${flags_here} ${source} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  foreach(sketch WifiEsp32 WifiEsp8266)
    execute_process(COMMAND ${chip_${chip}} ${flags} -I${KEY} -include Arduino.h -x c++
                            -c ${LIBRARY}/examples/${sketch}/${sketch}.ino -o ${TO}/${chip}.o
      COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endforeach()
