// Frames from a program on the same machine.

#include <sys/socket.h>

#include "drivers/video/socket_camera.hpp"
#include "hw-sim/base/listener.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  static const testing::Scratch folder;
  static const auto listener = hw_sim::listen_at_path(folder / "camera");
  auto camera = drivers::SocketCamera::open(folder / "camera");
  testing::must(listener && camera, "the camera listens");
  UniqueFd program(::accept(listener->get(), nullptr, nullptr));
  testing::must(::send(program.get(), data, size, MSG_NOSIGNAL) == static_cast<ssize_t>(size),
                "a socket takes a frame");
  program = UniqueFd();
  for (std::uint64_t damaged = 0;;) {
    const auto frame = (*camera)->next(Deadline::after(Duration::from_ms(10'000)));
    if (!frame) break;
    if (!*frame) {
      testing::must((*camera)->counters().incomplete == ++damaged, "the camera does not wait for who has gone");
      continue;
    }
    const auto pixels = static_cast<std::size_t>((*frame)->width_px) * static_cast<std::size_t>((*frame)->height_px);
    testing::must((*frame)->rgb->size() == 3 * pixels && pixels > 0, "a frame has all of its pixels");
    testing::must((*frame)->acquired.ns >= 0 && (*frame)->acquired_sigma.ns >= 0, "a frame's time is one");
  }
  return 0;
}
