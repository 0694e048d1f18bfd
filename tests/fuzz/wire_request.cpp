// What a client asks of an appliance. In what portions its bytes come makes no difference.

#include "device/wire/request.hpp"
#include "tests/fuzz/wire_bytes.hpp"

namespace {

using namespace birdseye;

/// The kinds of the requests; none where the bytes are no messages.
std::optional<std::vector<std::size_t>> kinds_of(testing::ByteView bytes, std::size_t portion) {
  wire::RequestReader reader;
  std::vector<std::size_t> kinds;
  testing::Pieces input(bytes);
  while (!input.empty()) {
    const auto requests = reader.push(input.take(portion));
    if (!requests) return std::nullopt;
    for (const wire::Request& request : *requests) kinds.push_back(request.index());
  }
  return kinds;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const testing::ByteView input(data, size);
  std::vector<std::uint8_t> plausible;
  for (const auto& message : testing::whole_messages(input))
    plausible.insert(plausible.end(), message.begin(), message.end());
  const std::size_t portion = 1 + size % 61;
  for (const testing::ByteView bytes : {input, testing::ByteView(plausible)}) {
    testing::must(kinds_of(bytes, bytes.size()) == kinds_of(bytes, portion), "portions make no difference");
  }
  return 0;
}
