# What the folders declare: libraries, tests and which build runs them, benchmarks.
include_guard()

# pheromone_library(name SOURCES file... [LINK target...] [CXX11])
# One static library a folder; includes are relative to the project's root. CXX11 marks what also
# runs on the robots' microcontrollers.
function(pheromone_library name)
  cmake_parse_arguments(arg "CXX11" "" "SOURCES;LINK" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${arg_LINK})
  if(arg_CXX11)
    set_target_properties(${name} PROPERTIES CXX_STANDARD 11)
  else()
    pheromone_precompiled(${name})
  endif()
endfunction()

# A test has one of four labels: unit, conformance, e2e, long. The preset "release" has all tests. The
# other builds leave out some, which they neither make nor run (DISABLED), or run with --long only
# (label "long"; the target long_tests makes them):
#
#                            release   gate      clang (ASan, UBSan)   tsan
#   pheromone_test           label     -         label                 -
#   ... THREADED             label     -         label                 label
#   ... RELEASED             label     label     long                  -
#   ... NOT_SANITIZED        label     label     -                     -
#   ... LABEL long           long      long      -                     -
#
# RELEASED: calculates or simulates more than it handles bytes and memory. NOT_SANITIZED: what is
# tested runs on another processor or in another program; or means over many runs, or searches
# through many states, of code that other tests run under sanitizers as well.
# A program or a script that is a test (pheromone_label) runs in the gate and under sanitizers, unless
# it is marked so.
add_custom_target(long_tests)
add_custom_target(threaded_tests)

# pheromone_runs(out label [SANITIZED] [RELEASED] [NOT_SANITIZED] [THREADED]): how this build has it:
# its label, "long" or "disabled".
function(pheromone_runs out label)
  cmake_parse_arguments(arg "SANITIZED;RELEASED;NOT_SANITIZED;THREADED" "" "" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "a test does not know ${arg_UNPARSED_ARGUMENTS}")
  endif()
  set(runs ${label})
  if(PHEROMONE_SANITIZE STREQUAL "thread")
    if(NOT arg_THREADED)
      set(runs disabled)
    endif()
  elseif(PHEROMONE_SANITIZE)
    if(arg_NOT_SANITIZED OR label STREQUAL "long")
      set(runs disabled)
    elseif(arg_RELEASED)
      set(runs long)
    endif()
  elseif(PHEROMONE_GATE AND arg_SANITIZED AND NOT label STREQUAL "long")
    set(runs disabled)
  endif()
  set(${out} ${runs} PARENT_SCOPE)
endfunction()

# pheromone_label(label [RELEASED] [NOT_SANITIZED] TESTS name...): of programs that were registered by
# add_test.
function(pheromone_label label)
  cmake_parse_arguments(arg "" "" "TESTS" ${ARGN})
  pheromone_runs(runs ${label} ${arg_UNPARSED_ARGUMENTS})
  if(runs STREQUAL "disabled")
    set_tests_properties(${arg_TESTS} PROPERTIES DISABLED ON)
  else()
    set_tests_properties(${arg_TESTS} PROPERTIES LABELS ${runs})
  endif()
endfunction()

# pheromone_script_test(name [LABEL label] [RELEASED] [NOT_SANITIZED] [PROPERTIES property value...]
#                       COMMAND script argument...)
# A script in Python, as a test; label "e2e" if none is given. Without Python there are none.
function(pheromone_script_test name)
  cmake_parse_arguments(arg "" "LABEL" "PROPERTIES;COMMAND" ${ARGN})
  if(NOT PYTHON3)
    return()
  endif()
  if(NOT arg_LABEL)
    set(arg_LABEL e2e)
  endif()
  list(POP_FRONT arg_COMMAND script)
  cmake_path(ABSOLUTE_PATH script NORMALIZE)
  add_test(NAME ${name} COMMAND ${PYTHON3} ${script} ${arg_COMMAND})
  pheromone_label(${arg_LABEL} ${arg_UNPARSED_ARGUMENTS} TESTS ${name})
  if(arg_PROPERTIES)
    set_tests_properties(${name} PROPERTIES ${arg_PROPERTIES})
  endif()
endfunction()

# pheromone_test_options(target OPTIMIZED|PLAIN): what all test programs are compiled with. Optimising
# most of them takes longer than running them once; OPTIMIZED ones spend their time in their own loops.
function(pheromone_test_options target kind)
  target_link_libraries(${target} PRIVATE GTest::gtest_main)
  target_compile_definitions(${target} PRIVATE
    PHEROMONE_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    PHEROMONE_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
  if(CMAKE_UNITY_BUILD)  # tests of a folder have more names in common than its sources
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 6)
  endif()
  if(PHEROMONE_GATE)
    # With precompiled headers, g++ 12 takes strings of its own library for overrun.
    target_compile_options(${target} PRIVATE
      $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-array-bounds -Wno-stringop-overflow>)
  endif()
  if(PHEROMONE_SANITIZE OR PHEROMONE_GATE)
    set(level -O0)
    if(kind STREQUAL "OPTIMIZED")
      set(level $<IF:$<CXX_COMPILER_ID:Clang>,-O1,-O2>)
    endif()
    target_compile_options(${target} PRIVATE $<$<CONFIG:RelWithDebInfo>:${level};-g0>)
  endif()
endfunction()

# The headers that most tests include, precompiled for the gate.
if(PHEROMONE_GATE OR (CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID MATCHES "Clang"))
  file(CONFIGURE OUTPUT test_headers.cc CONTENT "")
  foreach(kind PLAIN OPTIMIZED)
    add_library(test_headers_${kind} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/test_headers.cc)
    pheromone_test_options(test_headers_${kind} ${kind})
    target_precompile_headers(test_headers_${kind} PRIVATE
      <gtest/gtest.h> <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <map>
      <memory> <optional> <random> <string> <string_view> <thread> <variant> <vector>)
  endforeach()
endif()

# pheromone_test(name SOURCES file... [LINK target...] [LABEL label] [THREADED] [RELEASED]
#                [NOT_SANITIZED] [OPTIMIZED])
# One GoogleTest program, registered as one CTest test; label "unit" if none is given.
function(pheromone_test name)
  cmake_parse_arguments(arg "THREADED;RELEASED;NOT_SANITIZED;OPTIMIZED" "LABEL" "SOURCES;LINK" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "pheromone_test(${name}) does not know ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_LABEL)
    set(arg_LABEL unit)
  endif()
  set(marks)
  foreach(mark THREADED RELEASED NOT_SANITIZED)
    if(arg_${mark})
      list(APPEND marks ${mark})
    endif()
  endforeach()
  if(NOT arg_RELEASED AND NOT arg_NOT_SANITIZED)
    list(APPEND marks SANITIZED)
  endif()
  set(kind PLAIN)
  if(arg_OPTIMIZED)
    set(kind OPTIMIZED)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK})
  pheromone_test_options(${name} ${kind})
  if(TARGET test_headers_${kind} AND NOT "${arg_SOURCES}" MATCHES "\\.c(;|$)")
    target_precompile_headers(${name} REUSE_FROM test_headers_${kind})
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name})
  pheromone_runs(runs ${arg_LABEL} ${marks})
  if(runs STREQUAL "disabled")
    set_tests_properties(${name} PROPERTIES DISABLED ON)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  else()
    set_tests_properties(${name} PROPERTIES LABELS ${runs})
    if(runs STREQUAL "long")
      pheromone_exclude_from_gate(${name})
    endif()
  endif()
  if(arg_THREADED)
    add_dependencies(threaded_tests ${name})
  endif()
endfunction()

# pheromone_large_cases(test pattern...): cases of a test that are left out under sanitizers, since
# they are large, or many, runs of code that its other cases run as well.
function(pheromone_large_cases test)
  if(PHEROMONE_SANITIZE)
    list(JOIN ARGN ":" patterns)
    set_property(TEST ${test} APPEND PROPERTY ENVIRONMENT "GTEST_FILTER=-${patterns}")
  endif()
endfunction()

# pheromone_exclude_from_gate(target...): made by the preset "release", and elsewhere by long_tests.
function(pheromone_exclude_from_gate)
  if(PHEROMONE_SANITIZE OR PHEROMONE_GATE)
    set_target_properties(${ARGN} PROPERTIES EXCLUDE_FROM_ALL ON)
    add_dependencies(long_tests ${ARGN})
  endif()
endfunction()

# pheromone_exclude_from_sanitizers(target...): programs and libraries that under sanitizers only tests
# with --long need.
function(pheromone_exclude_from_sanitizers)
  if(PHEROMONE_SANITIZE)
    set_target_properties(${ARGN} PROPERTIES EXCLUDE_FROM_ALL ON)
    add_dependencies(long_tests ${ARGN})
  endif()
endfunction()

# pheromone_benchmark(target): no test runs it, so only the preset "release" makes it by itself.
function(pheromone_benchmark target)
  if(PHEROMONE_SANITIZE OR PHEROMONE_GATE)
    set_target_properties(${target} PROPERTIES EXCLUDE_FROM_ALL ON)
  else()
    pheromone_precompiled(${target})
  endif()
endfunction()
