#include "device/wire/igtl_bytes.hpp"

#include <algorithm>

#include "calibration/base/crc64.hpp"

namespace birdseye::wire {

namespace {

std::uint64_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8U | byte;
  return value;
}

std::string name_of(std::span<const std::uint8_t> bytes) {
  return {bytes.begin(), std::find(bytes.begin(), bytes.end(), 0)};
}

}  // namespace

std::uint64_t checksum(std::span<const std::uint8_t> bytes, std::uint64_t crc) {
  return ~crc64_ecma(bytes, ~crc);  // it inverts on the way in and out; the protocol does not
}

std::uint64_t stamp_from(DeviceTime time) {
  const auto seconds = static_cast<std::uint64_t>(time.ns / 1'000'000'000);
  const auto ns = static_cast<std::uint64_t>(time.ns % 1'000'000'000);
  return seconds << 32U | (((ns << 32U) + 500'000'000) / 1'000'000'000);
}

DeviceTime time_from(std::uint64_t stamp) {
  const std::uint64_t ns = ((stamp & 0xFFFFFFFFU) * 1'000'000'000 + (std::uint64_t{1} << 31U)) >> 32U;
  return {static_cast<std::int64_t>(stamp >> 32U) * 1'000'000'000 + static_cast<std::int64_t>(ns)};
}

Result<Header> read_header(std::span<const std::uint8_t> bytes, std::uint64_t most_bytes) {
  if (bytes.size() < kHeaderBytes) return Error{Errc::bad_format, "a message header that is cut short"};
  Header header;
  header.version = static_cast<unsigned>(big_endian(bytes.first(2)));
  header.type = name_of(bytes.subspan(2, 12));
  header.device = name_of(bytes.subspan(14, 20));
  header.time = time_from(big_endian(bytes.subspan(34, 8)));
  header.body_bytes = big_endian(bytes.subspan(42, 8));
  header.crc = big_endian(bytes.subspan(50, 8));
  const bool named = std::all_of(header.type.begin(), header.type.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (header.version < 1 || header.version > 3 || header.body_bytes > most_bytes || header.type.empty() || !named) {
    return Error{Errc::bad_format, "the other side does not speak OpenIGTLink; is the port right?"};
  }
  return header;
}

std::optional<StatusBody> status_of(const Header& header, std::span<const std::uint8_t> body) {
  constexpr std::size_t kFixed = 30;  // code, subcode, name of the error
  const auto content = content_of(header, body);
  if (!content || content->size() < kFixed) return std::nullopt;
  const auto text = content->subspan(kFixed);
  const unsigned code = static_cast<unsigned>((*content)[0]) << 8U | (*content)[1];
  return StatusBody{code, {text.begin(), std::find(text.begin(), text.end(), 0)}};
}

std::size_t content_bytes(const Header& header, std::span<const std::uint8_t> body) {
  if (header.version < 2) return body.size();
  const std::size_t extended = body.size() < 2 ? body.size() : static_cast<std::size_t>(big_endian(body.first(2)));
  return body.size() - std::min(extended, body.size());
}

std::optional<std::span<const std::uint8_t>> content_of(const Header& header, std::span<const std::uint8_t> body) {
  if (header.version < 2) return body;
  constexpr std::size_t kExtended = 12;  // its own size, those of the meta data's index and of the meta data, an id
  if (body.size() < kExtended) return std::nullopt;
  const auto before = static_cast<std::size_t>(big_endian(body.first(2)));
  const auto after = static_cast<std::size_t>(big_endian(body.subspan(2, 2))) +
                     static_cast<std::size_t>(big_endian(body.subspan(4, 4)));
  if (before < kExtended || before + after > body.size()) return std::nullopt;
  return body.subspan(before, body.size() - before - after);
}

std::optional<std::map<std::string, std::string>> meta_data_of(const Header& header,
                                                               std::span<const std::uint8_t> body) {
  std::map<std::string, std::string> found;
  if (header.version < 2) return found;
  const auto content = content_of(header, body);
  if (!content) return std::nullopt;
  // Index: how many there are; of each the key's length, the encoding and the value's length. Then all keys and values.
  constexpr std::size_t kCount = 2, kEntry = 8;
  const auto index = body.subspan(static_cast<std::size_t>(content->data() - body.data()) + content->size());
  if (index.size() < kCount) return index.empty() ? std::optional(found) : std::nullopt;
  const auto count = static_cast<std::size_t>(big_endian(index.first(kCount)));
  if (index.size() < kCount + kEntry * count) return std::nullopt;
  auto texts = index.subspan(kCount + kEntry * count);
  const auto text = [&](std::size_t size) {
    std::string out(texts.begin(), texts.begin() + static_cast<std::ptrdiff_t>(size));
    texts = texts.subspan(size);
    return out;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const auto entry = index.subspan(kCount + kEntry * i, kEntry);
    const auto key = static_cast<std::size_t>(big_endian(entry.first(2)));
    const auto value = static_cast<std::size_t>(big_endian(entry.subspan(4, 4)));
    if (key + value > texts.size()) return std::nullopt;
    std::string name = text(key);
    found.insert_or_assign(std::move(name), text(value));
  }
  return found;
}

std::optional<std::string> text_of_string(const Header& header, std::span<const std::uint8_t> body) {
  constexpr std::size_t kFixed = 4;  // encoding, length
  const std::size_t content = content_bytes(header, body);
  if (content < kFixed) return std::nullopt;
  const auto at = body.subspan(body.size() - content);
  const auto length = static_cast<std::size_t>(big_endian(at.subspan(2, 2)));
  if (kFixed + length > content) return std::nullopt;
  return std::string(at.begin() + kFixed, at.begin() + static_cast<std::ptrdiff_t>(kFixed + length));
}

}  // namespace birdseye::wire
