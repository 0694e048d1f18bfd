// What QEMU sends to the simulated FTDI chip.

#include "hw-sim/ftdi/usb_redir.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

/// Sizes of packets: their kind, the size of what follows the head, and an id, which is longer after the greeting.
void must_be_packets(birdseye::testing::ByteView bytes, bool greeted) {
  using birdseye::testing::must;
  for (std::size_t head = 12; !bytes.empty(); head = 16) {
    must(bytes.size() >= head, "packets are whole");
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length |= std::size_t{bytes[4 + i]} << 8 * i;
    must(bytes.size() >= head + length, "packets are whole");
    bytes = bytes.subspan(head + length);
    must(greeted || bytes.empty(), "nothing but a greeting goes to who has not greeted");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  testing::Pieces input({data, size});
  hw_sim::Ft232r chip{hw_sim::Ft232rSettings{}};
  hw_sim::UsbRedir redir(chip);
  DeviceTime now{1'000'000'000};
  std::vector<std::uint8_t> sent;
  while (!input.empty()) {
    const auto bytes = input.take(100);
    now = now + Duration::from_ms(1);
    chip.receive(bytes.first(std::min<std::size_t>(bytes.size(), 10)), now);
    const auto received = redir.receive(bytes, now);
    redir.pump(now);
    const auto out = redir.output();
    sent.insert(sent.end(), out.begin(), out.end());
    if (!received) break;
  }
  must_be_packets(sent, redir.plugged());
  return 0;
}
