# The host and the simulator. dpkg-shlibdeps does not see what is opened by name: OpenGL, the window's font, and ffmpeg,
# which writes films, the demo's too.
birdseye_package(birdseye SECTION 1 DEPENDS "ffmpeg, fonts-dejavu-core, libegl1, libgl1, libgl1-mesa-dri"
  RECOMMENDS "birdseye-sim (= ${PROJECT_VERSION}), birdseyed (= ${PROJECT_VERSION})"
  SUMMARY "registered, deformable CT over live laparoscopic video"
  DESCRIPTION "birdseye calibrates a tracked laparoscope, registers a CT to the patient,\nfollows how the organ has moved since, and draws the CT over the video.\nIts demo and its simulated cart need birdseyed and birdseye-sim.")
install(FILES birdseye.desktop DESTINATION usr/share/applications COMPONENT birdseye)
install(FILES birdseye.svg DESTINATION usr/share/icons/hicolor/scalable/apps COMPONENT birdseye)
# The manual, laid out as in the source, so that its links and the pages that messages name are found.
install(FILES ${CMAKE_SOURCE_DIR}/README.md ${CMAKE_SOURCE_DIR}/CONTRIBUTING.md ${CMAKE_SOURCE_DIR}/CHANGELOG.md
  DESTINATION usr/share/doc/birdseye COMPONENT birdseye)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs DESTINATION usr/share/doc/birdseye COMPONENT birdseye
  FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)

birdseye_package(birdseye-sim SECTION 1 SUGGESTS "birdseye, openmpi-bin"
  SUMMARY "simulated patient, tracker and laparoscope for Birdseye"
  DESCRIPTION "birdseye-sim stands in for the instruments of a laparoscope cart, byte for\nbyte, and knows what is true: the demo, the simulated cart and cases to\nmeasure a registration on are made with it.")
