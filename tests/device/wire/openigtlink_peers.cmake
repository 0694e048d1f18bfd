# The example programs of Debian's openigtlink-examples, built as they come: peers that nobody here wrote.
set(peer_sources /usr/share/doc/openigtlink-examples/examples)
if(NOT EXISTS ${peer_sources}/CMakeLists.txt)
  # Slim images of Debian leave out all of /usr/share/doc: then from the package itself.
  set(peer_package ${CMAKE_BINARY_DIR}/openigtlink-examples)
  set(peer_sources ${peer_package}/usr/share/doc/openigtlink-examples/examples)
  if(NOT EXISTS ${peer_sources}/CMakeLists.txt)
    file(MAKE_DIRECTORY ${peer_package})
    execute_process(COMMAND sh -c "apt-get -qq download openigtlink-examples && dpkg-deb -x openigtlink-examples*.deb ."
      WORKING_DIRECTORY ${peer_package} COMMAND_ERROR_IS_FATAL ANY)
  endif()
endif()

set(openigtlink_peers "")
foreach(peer Receiver/ReceiveClient TrackingData/TrackingDataClient Status/StatusClient Tracker/TrackerClient)
  get_filename_component(name ${peer} NAME)
  add_executable(${name} ${peer_sources}/${peer}.cxx)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/peers)
  target_compile_options(${name} PRIVATE -w)
  target_link_libraries(${name} PRIVATE birdseye_openigtlink Threads::Threads)
  list(APPEND openigtlink_peers ${name})
endforeach()

# The manual's example of a client.
add_executable(poses ${CMAKE_SOURCE_DIR}/docs/manual/examples/poses.cpp)
set_target_properties(poses PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/peers)
target_link_libraries(poses PRIVATE birdseye_openigtlink birdseye_options Threads::Threads)
