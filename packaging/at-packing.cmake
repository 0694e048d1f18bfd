# Read by cpack as it begins. Times in the packages are that of the last commit: who packs the same source later gets the
# same bytes. SOURCE_DATE_EPOCH, where it is set, says another.
if(NOT DEFINED ENV{SOURCE_DATE_EPOCH})
  execute_process(COMMAND git -C ${CPACK_BIRDSEYE_SOURCE} log -1 --format=%ct OUTPUT_VARIABLE committed
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(committed)
    set(ENV{SOURCE_DATE_EPOCH} ${committed})
  endif()
endif()

if(NOT CPACK_BIRDSEYE_SYSROOT)
  return()
endif()
# birdseyed was built for another machine, and dpkg-shlibdeps asks this one's own dpkg, which knows nothing of the sysroot.
# The dependencies: by what the program links and which package of the sysroot each library is of, from the version on that
# it was linked against.
execute_process(COMMAND readelf --dynamic ${CPACK_BIRDSEYED_PROGRAM} OUTPUT_VARIABLE dynamic COMMAND_ERROR_IS_FATAL ANY)
string(REGEX REPLACE "[][]" "'" dynamic "${dynamic}")  # brackets would hold the elements of a list together
string(REGEX MATCHALL "Shared library: '[^']+" needed "${dynamic}")
list(TRANSFORM needed REPLACE "^.*'" "")
file(STRINGS ${CPACK_BIRDSEYE_SYSROOT}/libraries.txt owners)
foreach(line ${owners})
  string(REPLACE " " ";" line ${line})
  list(GET line 0 library)
  list(GET line 1 package_of_${library})
  list(GET line 2 version_of_${library})
endforeach()
set(depends ${CPACK_DEBIAN_BIRDSEYED_PACKAGE_DEPENDS})
foreach(library ${needed})
  if(NOT package_of_${library})
    message(FATAL_ERROR "${library}: of no package in ${CPACK_BIRDSEYE_SYSROOT}; is its -dev package in arm64-packages.txt?")
  endif()
  string(REGEX REPLACE "-[^-]*$" "" version ${version_of_${library}})
  list(APPEND depends "${package_of_${library}} (>= ${version})")
endforeach()
list(REMOVE_DUPLICATES depends)
list(JOIN depends ", " CPACK_DEBIAN_BIRDSEYED_PACKAGE_DEPENDS)
