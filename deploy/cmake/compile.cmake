# How everything is compiled: warnings, sanitizers, levels of optimisation, precompiled headers.
include_guard()

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

# Assertions stay on. What ThreadSanitizer checks is order, so that its build need not be fast code;
# AddressSanitizer's own code costs more than the difference between -O1 and -O2.
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")
if(PHEROMONE_SANITIZE STREQUAL "thread")
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O0 -g1")
elseif(PHEROMONE_SANITIZE)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")
elseif(PHEROMONE_GATE)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2")
endif()

# The field's arithmetic is defined to the bit (protocol/README.md): a fused multiply-add would
# round once where the definition rounds twice.
add_compile_options(-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow
                    $<$<COMPILE_LANGUAGE:CXX>:-Wold-style-cast>
                    -ffp-contract=off $<$<BOOL:${PHEROMONE_WERROR}>:-Werror>)
# Libraries that a module of Python can have in it (client_fw/lab/python), as fast as others: nobody
# replaces a function of ours when a program is loaded, so it may be inlined.
if(NOT PHEROMONE_SANITIZE)
  add_compile_options(-fPIC $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
endif()
# At -O3, g++ 12 takes "text" + string for a copy onto itself (GCC bug 105651, fixed in 13).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  add_compile_options($<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-Wno-restrict>)
endif()
# Files that are compiled together g++ takes for headers, in which a class with a member of an
# unnamed namespace's type would be wrong.
if(CMAKE_UNITY_BUILD)
  add_compile_options($<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
endif()
if(PHEROMONE_GATE OR PHEROMONE_SANITIZE)
  find_program(PHEROMONE_LLD ld.lld)
  if(PHEROMONE_LLD)
    add_link_options(-fuse-ld=lld)  # some hundred programs, in half of ld's time
  endif()
endif()

if(PHEROMONE_FUZZERS)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "PHEROMONE_FUZZERS needs clang; use the preset \"clang\"")
  endif()
  set(PHEROMONE_LEADS_FUZZERS -fsanitize=fuzzer-no-link
      -fsanitize-coverage-ignorelist=${PROJECT_SOURCE_DIR}/proto_tests/fuzz/not_led_by.txt)
endif()
if(PHEROMONE_SANITIZE)
  add_compile_options(-fsanitize=${PHEROMONE_SANITIZE} -fno-sanitize-recover=all
                      -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${PHEROMONE_SANITIZE})
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    add_compile_options(-fno-sanitize=function)  # clang 14 cannot assemble it for coroutines
    add_compile_options(
      -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/proto_tests/undefined_behavior_elsewhere.txt)
  endif()
  if(PHEROMONE_SANITIZE MATCHES thread AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-Wno-tsan)  # Asio has fences, which g++'s ThreadSanitizer does not model
  endif()
endif()

# pheromone_optimize_level(level targets...): in builds of RelWithDebInfo.
function(pheromone_optimize_level level)
  foreach(target ${ARGN})
    target_compile_options(${target} PRIVATE $<$<CONFIG:RelWithDebInfo>:${level}>)
  endforeach()
endfunction()

# Code that waits for a peer or a disk: under AddressSanitizer, to optimise it takes longer than it
# ever runs.
function(pheromone_unoptimized_under_asan)
  if(PHEROMONE_SANITIZE MATCHES address)
    pheromone_optimize_level(-O0 ${ARGN})
  endif()
endfunction()

# Code for which no robot waits, such as command lines: -O1 in a release.
function(pheromone_optimized_little)
  pheromone_unoptimized_under_asan(${ARGN})
  if(NOT PHEROMONE_SANITIZE)
    pheromone_optimize_level(-O1 ${ARGN})
  endif()
endfunction()

# Inner loops that tests under ThreadSanitizer spend their time in.
function(pheromone_optimized_under_tsan)
  if(PHEROMONE_SANITIZE STREQUAL "thread")
    pheromone_optimize_level(-O1 ${ARGN})
  endif()
endfunction()

# pheromone_exclude_from_unity(folder file...): compiled by themselves also in a unity build, since
# they have names that another file of their folder has.
function(pheromone_exclude_from_unity folder)
  list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/${folder}/)
  set_source_files_properties(${ARGN} DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# pheromone_group_command_lines(target file...): compiled together in a unity build, since each would
# compile CLI11 whole. CMake then leaves the target's other files alone, unless they are in groups too.
function(pheromone_group_command_lines target)
  if(NOT CMAKE_UNITY_BUILD)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP command_lines)
  get_target_property(others ${target} SOURCES)
  list(REMOVE_ITEM others ${ARGN})
  set(count 0)
  foreach(file IN LISTS others)
    math(EXPR group "${count} / ${CMAKE_UNITY_BUILD_BATCH_SIZE}")
    math(EXPR count "${count} + 1")
    set_source_files_properties(${file} PROPERTIES UNITY_GROUP others_${group})
  endforeach()
endfunction()

# pheromone_precompiled(target...): what is to have the headers of the library, fmt and Asio
# precompiled, which are half of what most files cost.
function(pheromone_precompiled)
  set_property(GLOBAL APPEND PROPERTY pheromone_precompiled ${ARGN})
endfunction()

# Called once, when all targets are known: one set of precompiled headers for each level of
# optimisation, for what fuzzers reach, and with Asio where a target links it.
# (-DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON does without.)
function(pheromone_precompile_headers)
  if((CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND PHEROMONE_SANITIZE)
     OR (CMAKE_CXX_COMPILER_ID MATCHES "Clang" AND NOT CMAKE_UNITY_BUILD))
    return()
  endif()
  file(CONFIGURE OUTPUT precompiled.cc CONTENT "")
  get_property(targets GLOBAL PROPERTY pheromone_precompiled)
  foreach(target IN LISTS targets)
    get_target_property(options ${target} COMPILE_OPTIONS)
    string(REGEX MATCHALL "-O[0-3]" level "${options}")
    get_target_property(led ${target} PHEROMONE_LED)
    get_target_property(linked ${target} LINK_LIBRARIES)
    set(headers precompiled${level})
    if(led)
      string(APPEND headers _fuzzers)
    endif()
    if(asio IN_LIST linked)
      string(APPEND headers _asio)
    endif()
    if(NOT TARGET ${headers})
      add_library(${headers} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/precompiled.cc)
      target_link_libraries(${headers} PRIVATE fmt::fmt)
      if(level)
        pheromone_optimize_level(${level} ${headers})
      endif()
      if(led)
        target_compile_options(${headers} PRIVATE ${PHEROMONE_LEADS_FUZZERS})
      endif()
      target_precompile_headers(${headers} PRIVATE
        <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <fstream> <functional> <map> <memory>
        <optional> <set> <string> <string_view> <utility> <variant> <vector> <fmt/format.h>)
      if(asio IN_LIST linked)
        target_link_libraries(${headers} PRIVATE asio)
        target_precompile_headers(${headers} PRIVATE
          <boost/asio/co_spawn.hpp> <boost/asio/detached.hpp> <boost/asio/io_context.hpp>
          <boost/asio/ip/tcp.hpp> <boost/asio/redirect_error.hpp> <boost/asio/steady_timer.hpp>
          <boost/asio/strand.hpp> <boost/asio/use_awaitable.hpp> <boost/json.hpp>)
      endif()
    endif()
    target_link_libraries(${target} PRIVATE fmt::fmt)
    target_precompile_headers(${target} REUSE_FROM ${headers})
  endforeach()
endfunction()
