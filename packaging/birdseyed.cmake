# The appliance: a service, its configuration and its rights. The unit reloads with kill.
birdseye_package(birdseyed SECTION 8 DEPENDS "procps, systemd"
  SUMMARY "tracker and camera of a laparoscope cart, on one clock"
  DESCRIPTION "birdseyed reads a miniBIRD tracker and a camera, relates both to one clock,\npairs each frame with the scope's pose at its own time and publishes them\nover OpenIGTLink.")
install(FILES birdseyed.toml DESTINATION etc/birdseye COMPONENT birdseyed)
install(FILES birdseyed.service DESTINATION usr/lib/systemd/system COMPONENT birdseyed)
install(FILES birdseyed.sysusers DESTINATION usr/lib/sysusers.d RENAME birdseyed.conf COMPONENT birdseyed)
install(FILES 60-birdseye.rules DESTINATION usr/lib/udev/rules.d COMPONENT birdseyed)
set(deb ${CMAKE_CURRENT_SOURCE_DIR}/birdseyed-deb)
set(CPACK_DEBIAN_BIRDSEYED_PACKAGE_CONTROL_EXTRA ${deb}/conffiles ${deb}/postinst ${deb}/prerm ${deb}/postrm)

# The appliance's pages and all that they link to, in the folders that their links expect.
foreach(page clocks.md decisions/0022-arm64-in-a-sysroot.md decisions/0035-errors-one-may-believe.md images/case.jpg
    manual/birdseyed.md manual/calibrate-camera.md manual/calibrate-field.md manual/calibrate-hand-eye.md manual/calibrate-latency.md
    manual/calibrate-tip.md manual/calibration-patterns.md manual/calibration-record.md manual/cameras.md manual/embedded.md manual/faults.md manual/frame-socket.md manual/frames.md manual/gpio.md
    manual/minibird.md manual/pairing.md manual/pose-files.md manual/appliance-recording.md manual/serial-lines.md manual/service.md manual/signatures.md manual/simulated-minibird.md manual/simulator.md manual/wire.md
    manual/examples/average.py manual/examples/board.py manual/examples/poses.cpp manual/examples/poses.py
    manual/examples/track.py manual/examples/watch.py)
  get_filename_component(folder ${page} DIRECTORY)
  install(FILES ${CMAKE_SOURCE_DIR}/docs/${page} DESTINATION usr/share/doc/birdseyed/${folder} COMPONENT birdseyed)
endforeach()
