# Debian's cross compiler on Debian's arm64 packages, which packaging/arm64-sysroot has unpacked; tests run under qemu-user.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

get_filename_component(birdseye_sysroot ${CMAKE_CURRENT_LIST_DIR}/../build/arm64-sysroot ABSOLUTE)
if(NOT EXISTS ${birdseye_sysroot}/key)
  message(FATAL_ERROR "${birdseye_sysroot}: no arm64 packages there; `packaging/arm64-sysroot build/arm64-sysroot` fetches them")
endif()
set(CMAKE_SYSROOT ${birdseye_sysroot})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
# For pkg-config, which CMake's roots say nothing to.
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${birdseye_sysroot})
set(ENV{PKG_CONFIG_LIBDIR} ${birdseye_sysroot}/usr/lib/aarch64-linux-gnu/pkgconfig:${birdseye_sysroot}/usr/lib/pkgconfig:${birdseye_sysroot}/usr/share/pkgconfig)

set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static;-L;${birdseye_sysroot})
