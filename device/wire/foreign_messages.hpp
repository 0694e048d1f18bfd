#pragma once

#include <optional>
#include <set>
#include <variant>

#include "device/wire/igtl_bytes.hpp"
#include "device/wire/messages.hpp"

/// What an OpenIGTLink server that is no appliance of ours (PLUS, 3D Slicer) says of video and tools, by the published
/// standard: header versions 1 to 3, and of the meta data whether a pose is valid.
namespace birdseye::wire {

/// One picture, RGB; grey pictures are converted. The matrix of an IMAGE, which places it in a room, means nothing for
/// a camera's picture: pixels are taken in their order, the first row at the top.
struct ForeignPicture {
  int width_px = 0, height_px = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> rgb;
};

/// An IMAGE of more than one slice: no video.
struct ForeignVolume {};

/// Poses of tools by their names, mm. Of a TRANSFORM or POSITION the name is the device's, of TDATA and QTDATA the
/// element's.
struct ForeignPoses {
  std::vector<Bird> birds;
  /// Tools without a pose, out of sight for example: their matrix or quaternion is no rotation, or the meta data call
  /// it invalid.
  std::vector<std::string> no_poses;
  std::set<std::string> doubled;  ///< of these two stand in the list, and so neither has a pose
};

/// STATUS, which some send to keep the connection alive too. words: what is wrong; empty: nothing.
struct ForeignStatus {
  std::string words;
};

/// The answer to what our client asks: nothing to tell.
struct ForeignAnswer {};

/// A message of a type that is not read here.
struct ForeignOther {};

using ForeignMessage =
    std::variant<ForeignPicture, ForeignVolume, ForeignPoses, ForeignStatus, ForeignAnswer, ForeignOther>;

/// A name as it may be shown and written: whatever is no printable ASCII becomes a question mark.
std::string readable(std::string name);

/// header: with a readable() device name. Errc::bad_format: damaged, or its lengths lie. Errc::unsupported: pictures
/// that are not of 8 bits with one or three components. The error names the message's type and device.
Result<ForeignMessage> read_foreign(const Header& header, std::span<const std::uint8_t> body);

/// Whether the message is one that only an appliance of ours sends.
bool is_of_appliance(const Header& header);

}  // namespace birdseye::wire
