// The marks that a terminal puts into its input. In what portions the bytes come makes no difference.

#include <vector>

#include "drivers/io/serial_marks.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace birdseye;

struct Decoded {
  std::vector<std::uint8_t> bytes;
  std::size_t damaged = 0;
  bool operator==(const Decoded&) const = default;
};

Decoded decoded(testing::ByteView raw, std::size_t portion) {
  drivers::SerialMarks marks;
  Decoded out;
  testing::Pieces input(raw);
  while (!input.empty()) {
    for (testing::ByteView piece = input.take(portion); !piece.empty();) {
      std::vector<std::uint8_t> into(piece.size());
      const auto step = marks.decode(piece, into);
      out.bytes.insert(out.bytes.end(), into.begin(), into.begin() + static_cast<std::ptrdiff_t>(step.made));
      if (step.damaged) ++out.damaged;
      piece = piece.subspan(step.used);
    }
  }
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const testing::ByteView input(data, size);
  testing::must(decoded(input, 1) == decoded(input, size), "portions make no difference");
  return 0;
}
