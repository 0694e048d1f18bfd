# birdseye_library(name SOURCES ... PUBLIC libs... PRIVATE libs...), birdseye_executable(...), birdseye_test(...):
# our own targets, with the warnings and sanitizers that all of them share. Libraries are static. The release preset
# compiles a target's files in batches, in which a name stands for one thing (docs/decisions/0031-files-in-batches.md).

# The target all_verify_interface_header_sets compiles each header of a library alone, with what the library links PUBLIC.
set(CMAKE_VERIFY_INTERFACE_HEADER_SETS ON)

add_library(birdseye_options INTERFACE)
target_compile_options(birdseye_options INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -Werror
  $<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>
  $<$<AND:$<CXX_COMPILER_ID:Clang>,$<BOOL:${CMAKE_UNITY_BUILD}>>:-Wno-shadow>)  # of another file's name in the batch
# Damage by a hostile file or message ends the program rather than taking it over.
target_compile_options(birdseye_options INTERFACE -fPIE -fstack-protector-strong -fstack-clash-protection)
target_include_directories(birdseye_options INTERFACE ${CMAKE_SOURCE_DIR})
if(BIRDSEYE_SANITIZE)
  target_compile_options(birdseye_options INTERFACE -fsanitize=${BIRDSEYE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(birdseye_options INTERFACE -fsanitize=${BIRDSEYE_SANITIZE})
  if(BIRDSEYE_SANITIZE MATCHES "fuzzer")
    # By its older name, which ccache knows for one of a file.
    target_compile_options(birdseye_options INTERFACE -fsanitize-blacklist=${CMAKE_SOURCE_DIR}/tests/fuzz/unwatched.txt)
  endif()
else()
  # It wants an optimising compiler, and would hide from a sanitizer what it checks itself.
  target_compile_options(birdseye_options INTERFACE "$<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=3>")
endif()

# The library's headers are those of its folder. NOT_ALONE names those that ask for more than the library has: whoever
# includes one sees to what it needs.
function(birdseye_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE;NOT_ALONE" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} birdseye_options)
  file(GLOB headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.hpp)
  list(TRANSFORM ARG_NOT_ALONE PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  list(REMOVE_ITEM headers ${ARG_NOT_ALONE})
  target_sources(${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${CMAKE_SOURCE_DIR} FILES ${headers})
endfunction()

# Programs resolve all names as they start, into pages that nothing writes afterwards. Tests do not: each starts anew.
function(birdseye_executable name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PRIVATE" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_PRIVATE} birdseye_options)
  target_link_options(${name} PRIVATE -pie -Wl,-z,relro -Wl,-z,now)
endfunction()

# The key of the machine on which tests run: never that of whoever runs them.
set(BIRDSEYE_TEST_IDENTITY ${CMAKE_BINARY_DIR}/test-identity)

# One executable of GoogleTests; LABEL is unit, hw, gl, e2e or realtime. Beside one of realtime nothing else runs, for a
# machine that is busy with other things would rightly show or keep less than it looks for.
# STUDIES: those of its tests that take long, by GoogleTest's patterns. Their label is study: ./run studies runs them, and
# ./run test all others. One that takes ten minutes hangs, on however busy a machine.
function(birdseye_test name)
  cmake_parse_arguments(ARG "" "LABEL" "SOURCES;PRIVATE;STUDIES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_PRIVATE} birdseye_options GTest::gmock_main)
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  # Not in the environment, where gtest_discover_tests keeps only the first of several. The emulator, empty on the machine
  # that is built for, goes before programs that a test runs.
  list(JOIN CMAKE_CROSSCOMPILING_EMULATOR " " emulator)
  target_compile_definitions(${name} PRIVATE BIRDSEYE_EMULATOR="${emulator}")
  set(alone "")
  if(ARG_LABEL STREQUAL "realtime")
    set(alone RUN_SERIAL TRUE)
  endif()
  list(JOIN ARG_STUDIES ":" studies)
  foreach(label ${ARG_LABEL} study)
    if(label STREQUAL "study")
      set(filter "${studies}")
    else()
      set(filter "*-${studies}")
    endif()
    if(NOT filter STREQUAL "")
      gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_FILTER "${filter}" TEST_LIST ${name}_${label}
        PROPERTIES LABELS ${label} TIMEOUT 600 ${alone}
          ENVIRONMENT "BIRDSEYE_SOURCE_DIR=${CMAKE_SOURCE_DIR}"
          ENVIRONMENT_MODIFICATION "BIRDSEYE_IDENTITY=set:${BIRDSEYE_TEST_IDENTITY}")
    endif()
  endforeach()
endfunction()

# A program that gives bytes to one parser: main is libFuzzer's, which clang alone has. Built by its name or with all of its
# kind, as `fuzz`, and never otherwise (preset fuzz, ./run fuzz).
function(birdseye_fuzz name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PRIVATE" ${ARGN})
  add_executable(${name} EXCLUDE_FROM_ALL ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_PRIVATE} birdseye_options)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  if(NOT TARGET fuzz)
    add_custom_target(fuzz)
  endif()
  add_dependencies(fuzz ${name})
endfunction()
