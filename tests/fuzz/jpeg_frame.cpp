// A camera's JPEG picture; the first two bytes of an input are the size that the camera agreed to.

#include "drivers/video/jpeg_decoder.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  testing::Pieces input({data, size});
  const int width_px = 1 + input.byte(), height_px = 1 + input.byte();
  std::vector<std::uint8_t> rgb;
  if (!drivers::decode_jpeg(input.take(size), width_px, height_px, rgb)) return 0;
  testing::must(rgb.size() == 3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px),
                "a picture has all of its pixels");
  return 0;
}
