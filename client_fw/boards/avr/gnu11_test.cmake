# All that runs on a robot compiles as gnu++11 too, with and without tags and signing:
#
#   cmake -DCOMPILER=avr-g++ -DROOT=. -DSOURCES=protocol/frame.cc,... -P gnu11_test.cmake
string(REPLACE "," ";" SOURCES "${SOURCES}")
foreach(tags 0 1)
  foreach(source IN LISTS SOURCES)
    execute_process(
      COMMAND ${COMPILER} -mmcu=atmega328p -std=gnu++11 -Os -fsyntax-only -Wall -Wextra -Werror
              -DPHEROMONE_TAGS=${tags} -DPHEROMONE_SIGNING=${tags} -I${ROOT} ${ROOT}/${source}
      COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endforeach()
