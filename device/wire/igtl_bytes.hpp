#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"

/// The bytes that every OpenIGTLink message has, and its checksum.
namespace birdseye::wire {

/// Of a bird's name as much as TDATA has room for.
inline constexpr std::size_t kMostBirdNameBytes = 20;
/// And as much as a TRANSFORM's device name has room for, with "ToTracker" behind.
inline constexpr std::size_t kMostTransformNameBytes = 11;
inline constexpr std::size_t kHeaderBytes = 58;

/// The protocol's checksum: CRC-64 of ECMA-182, by ISA-L, which is thirty times as fast as the protocol library's own.
/// crc: that of the bytes before these.
std::uint64_t checksum(std::span<const std::uint8_t> bytes, std::uint64_t crc = 0);

/// The standard's stamp: seconds, and a fraction in units of 2^-32 s, rounded so that nanoseconds come back exactly.
std::uint64_t stamp_from(DeviceTime time);
DeviceTime time_from(std::uint64_t stamp);

/// A message's header, unpacked here because the library's own unpacking reports no failure.
struct Header {
  unsigned version = 0;
  std::string type, device;
  DeviceTime time;
  std::uint64_t body_bytes = 0, crc = 0;
};
/// Refuses what is no header, and a body of more than most_bytes.
Result<Header> read_header(std::span<const std::uint8_t> bytes, std::uint64_t most_bytes);

/// The text of a STRING's body; empty where its lengths lie.
std::optional<std::string> text_of_string(const Header& header, std::span<const std::uint8_t> body);

/// What a STATUS says: 1 is OK.
struct StatusBody {
  unsigned code = 0;
  std::string text;
};
/// Empty where it is cut short. By hand: the library's reads on until a zero byte, which nobody may have sent.
std::optional<StatusBody> status_of(const Header& header, std::span<const std::uint8_t> body);

/// Size of the content in bytes. In version 2 an extended header precedes the content, and begins with its own size.
std::size_t content_bytes(const Header& header, std::span<const std::uint8_t> body);
/// The content alone, without the meta data that follows it in version 2; empty where their lengths lie.
std::optional<std::span<const std::uint8_t>> content_of(const Header& header, std::span<const std::uint8_t> body);
/// The meta data by their keys; none in version 1. Empty where their lengths lie.
std::optional<std::map<std::string, std::string>> meta_data_of(const Header& header,
                                                               std::span<const std::uint8_t> body);

}  // namespace birdseye::wire
