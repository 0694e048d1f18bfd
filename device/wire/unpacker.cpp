#include "device/wire/unpacker.hpp"

#include <fmt/format.h>
#include <igtlImageMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtl_image.h>
#include <igtl_tdata.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/geometry/rigid_matrix.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/json.hpp"

namespace birdseye::wire {

namespace {

using MaybeTold = std::optional<Unpacker::Told>;

Error unpack_failed(const std::string& what) {
  return {Errc::bad_format, fmt::format("a {} message that does not unpack; is the other side a birdseyed?", what)};
}

/// The message of type M that the bytes hold; null where they hold none. Their checksum has been checked.
template <typename M>
typename M::Pointer unpacked(std::span<const std::uint8_t> bytes) {
  const auto header = igtl::MessageHeader::New();
  header->InitPack();
  std::memcpy(header->GetPackPointer(), bytes.data(), kHeaderBytes);
  header->Unpack();
  auto message = M::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  const auto body = static_cast<std::size_t>(message->GetPackBodySize());
  if (body + kHeaderBytes != bytes.size()) return nullptr;
  std::memcpy(message->GetPackBodyPointer(), bytes.data() + kHeaderBytes, body);
  if ((message->Unpack(0) & igtl::MessageHeader::UNPACK_BODY) == 0) return nullptr;
  return message;
}

/// The library believes the lengths inside a body, and a checksum is no proof of them: they are held against the bytes
/// that there are, and the pixels are taken from where they came in.
Result<VideoFrame> frame_of(const Header& header, std::span<const std::uint8_t> body, FrameInfo info) {
  const std::size_t content = content_bytes(header, body);
  if (content < IGTL_IMAGE_HEADER_SIZE) return unpack_failed("IMAGE");
  const auto at = body.subspan(body.size() - content);
  igtl_image_header image{};
  std::memcpy(&image, at.data(), IGTL_IMAGE_HEADER_SIZE);
  igtl_image_convert_byte_order(&image);
  const std::size_t size = std::size_t{image.size[0]} * image.size[1] * 3;
  bool whole = image.size[0] > 0 && image.size[1] > 0 && image.size[2] == 1 && image.num_components == 3 &&
               image.scalar_type == IGTL_IMAGE_STYPE_TYPE_UINT8 && content - IGTL_IMAGE_HEADER_SIZE >= size;
  for (int i = 0; i < 3; ++i) whole = whole && image.subvol_size[i] == image.size[i] && image.subvol_offset[i] == 0;
  if (!whole) return unpack_failed("IMAGE");
  const std::uint8_t* const pixels = at.data() + IGTL_IMAGE_HEADER_SIZE;
  return VideoFrame{std::move(info), image.size[0], image.size[1],
                    std::make_shared<const std::vector<std::uint8_t>>(pixels, pixels + size)};
}

/// Empty where the matrix is no pose: nothing downstream may draw by it.
std::optional<Transform<Tracker, Sensor>> pose_of(igtl::TrackingDataElement& element) {
  igtl::Matrix4x4 matrix;
  element.GetMatrix(matrix);
  Eigen::Matrix4d m;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) m(row, column) = static_cast<double>(matrix[row][column]);
  }
  if (!is_rigid(m, 1e-4)) return std::nullopt;
  // Through a quaternion: single precision leaves the rotation a little off orthonormal.
  return Transform<Tracker, Sensor>(Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>())),
                                    Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

/// Empty where one of them is no pose, or two have one name: nobody could say which of them is that bird's.
std::optional<Birds> birds_of(igtl::TrackingDataMessage& message, DeviceTime time) {
  Birds birds;
  birds.acquired = time;
  for (int i = 0; i < message.GetNumberOfTrackingDataElements(); ++i) {
    igtl::TrackingDataElement::Pointer element;
    message.GetTrackingDataElement(i, element);
    const auto pose = pose_of(*element);
    const std::string name = element->GetName();
    if (!pose || std::ranges::find(birds.birds, name, &Bird::name) != birds.birds.end()) return std::nullopt;
    birds.birds.push_back({name, *pose});
  }
  return birds;
}

Result<MaybeTold> event_of_status(const Header& header, std::span<const std::uint8_t> body) {
  auto status = status_of(header, body);
  if (!status) return unpack_failed("STATUS");
  return MaybeTold(Event(Status{status->code == igtl::StatusMessage::STATUS_OK, std::move(status->text)}));
}

}  // namespace

Result<std::uint64_t> body_bytes(std::span<const std::uint8_t> header) {
  const auto read = read_header(header, kLargestBody);
  if (!read) return read.error();
  return read->body_bytes;
}

Result<MaybeTold> Unpacker::push_string(const std::string& device, const std::string& text) {
  try {
    const auto json = nlohmann::json::parse(text);
    if (device == kFrameInfoDevice) {
      info_ = json.get<FrameInfo>();
      return MaybeTold();
    }
    if (device == kHealthDevice) return MaybeTold(Event(json.get<Health>()));
    if (device == kDoubtDevice) return MaybeTold(Event(json.get<Doubt>()));
    if (device == kClockChangeDevice) return MaybeTold(Event(json.get<ClockChange>()));
    if (device == kPedalDevice) return MaybeTold(Event(json.get<Pedal>()));
    if (device == kCalibrationDevice) return MaybeTold(Event(json.get<Calibration>()));
    if (device == kCameraControlsDevice) return MaybeTold(Event(json.get<CameraControls>()));
    return MaybeTold(json.get<ClockPong>());
  } catch (const nlohmann::json::exception&) {
    return unpack_failed("STRING");
  }
}

Result<MaybeTold> Unpacker::push(std::span<const std::uint8_t> bytes) {
  const auto header = read_header(bytes, kLargestBody);
  if (!header || header->body_bytes + kHeaderBytes != bytes.size()) return unpack_failed("cut");
  // What we send has headers of version 1; the library does not know that those of version 2 go on in the body.
  if (header->version != 1) return MaybeTold();
  const auto body = bytes.subspan(kHeaderBytes);
  const std::string& type = header->type;
  const std::string& device = header->device;
  static constexpr std::array kStrings{kFrameInfoDevice, kHealthDevice,    kDoubtDevice,          kClockChangeDevice,
                                       kPedalDevice,     kClockPongDevice, kCameraControlsDevice, kCalibrationDevice};
  const bool string = type == "STRING" &&
                      std::any_of(kStrings.begin(), kStrings.end(), [&](const char* name) { return device == name; });
  const bool image = type == "IMAGE" && device == kVideoDevice && info_;
  const bool birds = type == "TDATA" && device == kBirdsDevice;
  const bool status = type == "STATUS" && device == kStatusDevice;
  if (!string && !image && !birds && !status) return MaybeTold();
  if (checksum(body) != header->crc) return unpack_failed(type);
  if (string) {
    const auto text = text_of_string(*header, body);
    if (!text) return unpack_failed(type);
    return push_string(device, *text);
  }
  if (image) {
    FrameInfo info = *std::exchange(info_, std::nullopt);
    // Both were written of one time: what is of another is not this picture's.
    if (header->time.ns != time_from(stamp_from(info.acquired)).ns) return unpack_failed(type);
    auto frame = frame_of(*header, body, std::move(info));
    if (!frame) return frame.error();
    return MaybeTold(Event(*std::move(frame)));
  }
  if (birds) {
    if (body.empty()) return MaybeTold(Event(Birds{header->time, {}}));  // which the library takes for a failure
    if (body.size() % IGTL_TDATA_ELEMENT_SIZE != 0) return unpack_failed(type);  // the library would read on
    const auto message = unpacked<igtl::TrackingDataMessage>(bytes);
    if (message == nullptr) return unpack_failed(type);
    auto found = birds_of(*message, header->time);
    if (!found) return unpack_failed(type);
    return MaybeTold(Event(*std::move(found)));
  }
  return event_of_status(*header, body);
}

}  // namespace birdseye::wire
