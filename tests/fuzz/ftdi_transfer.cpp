// What an FTDI adapter passes on over USB, taken in portions.

#include <array>

#include "drivers/io/ftdi_receiver.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  constexpr std::size_t kMost = 1024;
  testing::Pieces input({data, size});
  drivers::FtdiReceiver receiver(input.byte() % 2 == 0 ? std::size_t{64} : std::size_t{512}, kMost);
  std::array<std::uint8_t, 100> into{};
  std::size_t came = 0, taken = 0, left = 0;
  DeviceTime now, of_last;
  while (!input.empty()) {
    const std::size_t how = input.byte();
    now = now + Duration::from_ms(1);
    if (how == 255) {
      receiver.push_failed();
    } else if (how == 254) {
      receiver.clear();
    } else if (how % 4 == 3) {
      const auto piece = receiver.take(std::span(into).first(how % into.size()));
      taken += piece.bytes;
      testing::must(piece.bytes == 0 || piece.arrived >= of_last, "bytes come in the order of their times");
      if (piece.bytes > 0) of_last = piece.arrived;
    } else {
      const auto transfer = input.take(4 * how);
      came += transfer.size();
      receiver.push(transfer, now);
    }
  }
  while (!receiver.empty()) left += receiver.take(into).bytes;
  testing::must(left <= kMost, "no more waits than may");
  testing::must(taken + left <= came, "no byte comes twice");
  return 0;
}
