# Fails if an image needs more flash or static memory than it is allowed:
#
#   cmake -DSIZE=avr-size -DELF=image.elf -DFLASH=16384 -DRAM=1536 -P check_size.cmake
#
# Flash holds code and the initial values of variables; memory the variables, those that start-up
# leaves alone (.noinit) included.
execute_process(COMMAND ${SIZE} -B ${ELF} OUTPUT_VARIABLE table COMMAND_ERROR_IS_FATAL ANY)
if(NOT table MATCHES "\n *([0-9]+)[ \t]+([0-9]+)[ \t]+([0-9]+)[ \t]")
  message(FATAL_ERROR "${SIZE} says what is not understood:\n${table}")
endif()
math(EXPR flash "${CMAKE_MATCH_1} + ${CMAKE_MATCH_2}")
math(EXPR ram "${CMAKE_MATCH_2} + ${CMAKE_MATCH_3}")
message(STATUS "flash ${flash} of ${FLASH} bytes, static memory ${ram} of ${RAM} bytes")
if(flash GREATER FLASH OR ram GREATER RAM)
  message(FATAL_ERROR "too large: ${ELF}")  # the words first: cmake wraps after long paths
endif()
