#include "device/wire/packet.hpp"

#include <igtlStatusMessage.h>
#include <igtl_header.h>
#include <igtl_image.h>
#include <igtl_tdata.h>
#include <igtl_transform.h>
#include <igtl_util.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

#include "device/wire/igtl_bytes.hpp"
#include "device/wire/json.hpp"

namespace birdseye::wire {

namespace {

void stamp(igtl::MessageBase& message, DeviceTime time) {
  const std::uint64_t stamp = stamp_from(time);
  message.SetTimeStamp(static_cast<unsigned>(stamp >> 32U), static_cast<unsigned>(stamp & 0xFFFFFFFFU));
}

void append(std::vector<std::uint8_t>& out, igtl::MessageBase& message) {
  message.Pack();
  const auto* bytes = static_cast<const std::uint8_t*>(message.GetPackPointer());
  out.insert(out.end(), bytes, bytes + message.GetPackSize());
}

void append_header(std::vector<std::uint8_t>& out, const char* type, const char* device, DeviceTime time,
                   std::uint64_t body_bytes, std::uint64_t crc, std::uint16_t version = 1) {
  igtl_header header{};
  header.version = version;
  std::string_view(type).copy(header.name, sizeof header.name);
  std::string_view(device).copy(header.device_name, sizeof header.device_name);
  header.timestamp = stamp_from(time);
  header.body_size = body_bytes;
  header.crc = crc;
  igtl_header_convert_byte_order(&header);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&header);
  out.insert(out.end(), bytes, bytes + sizeof header);
}

/// By hand: the library takes a checksum a byte at a time.
void append_string(std::vector<std::uint8_t>& out, const char* device, const nlohmann::json& json, DeviceTime time) {
  constexpr std::uint8_t kAscii = 3;  // as IANA numbers encodings
  const std::string text = text_of(json);
  const auto size = static_cast<std::uint16_t>(text.size());
  const std::array<std::uint8_t, 4> lead{0, kAscii, static_cast<std::uint8_t>(size >> 8U),
                                         static_cast<std::uint8_t>(size & 0xFFU)};
  const std::span body(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  append_header(out, "STRING", device, time, lead.size() + body.size(), checksum(body, checksum(lead)));
  out.insert(out.end(), lead.begin(), lead.end());
  out.insert(out.end(), body.begin(), body.end());
}

Packet string_packet(const char* device, const nlohmann::json& json, DeviceTime time) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_string(*out, device, json, time);
  return {Packet::Kind::other, std::move(out), nullptr, {}};
}

/// An IMAGE's header and that of its body, for pixels that are sent from where they are: the library would copy them
/// twice and take their checksum a byte at a time.
void append_image_heads(std::vector<std::uint8_t>& out, const VideoFrame& frame) {
  igtl_image_header image{};
  image.version = IGTL_IMAGE_HEADER_VERSION;
  image.num_components = 3;
  image.scalar_type = IGTL_IMAGE_STYPE_TYPE_UINT8;
  image.endian = IGTL_IMAGE_ENDIAN_LITTLE;
  image.coord = IGTL_IMAGE_COORD_RAS;
  const std::uint16_t size[3] = {static_cast<std::uint16_t>(frame.width_px),
                                 static_cast<std::uint16_t>(frame.height_px), 1};
  std::copy_n(size, 3, image.size);
  std::copy_n(size, 3, image.subvol_size);
  image.matrix[0] = image.matrix[4] = image.matrix[8] = 1.0F;  // a pixel is a unit long and stands on the axes
  igtl_image_convert_byte_order(&image);
  const std::span image_bytes(reinterpret_cast<const std::uint8_t*>(&image), sizeof image);
  append_header(out, "IMAGE", kVideoDevice, frame.info.acquired, sizeof image + frame.rgb->size(),
                checksum(*frame.rgb, checksum(image_bytes)));
  out.insert(out.end(), image_bytes.begin(), image_bytes.end());
}

/// Column by column, the position last.
void put_columns(const Eigen::Matrix4d& matrix, igtl_float32* numbers) {
  const Eigen::Matrix<float, 3, 4> columns = matrix.topRows<3>().cast<float>();
  std::copy_n(columns.data(), 12, numbers);
}

/// By hand, as the library's is.
void append_transform(std::vector<std::uint8_t>& out, const std::string& device, const Eigen::Matrix4d& matrix,
                      DeviceTime time) {
  std::array<igtl_float32, 12> numbers{};
  put_columns(matrix, numbers.data());
  igtl_transform_convert_byte_order(numbers.data());
  const std::span body(reinterpret_cast<const std::uint8_t*>(numbers.data()), sizeof numbers);
  append_header(out, "TRANSFORM", device.c_str(), time, body.size(), checksum(body));
  out.insert(out.end(), body.begin(), body.end());
}

}  // namespace

std::vector<std::uint8_t> Packet::bytes() const {
  std::vector<std::uint8_t> all(*head);
  if (pixels) all.insert(all.end(), pixels->begin(), pixels->end());
  return all;
}

Packet pack(const VideoFrame& frame) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_string(*out, kFrameInfoDevice, frame.info, frame.info.acquired);
  append_image_heads(*out, frame);
  return {Packet::Kind::frame, std::move(out), frame.rgb, frame.info.arrived};
}

/// By hand: the library leaves a byte of each element as memory happens to be.
Packet pack(const Birds& birds, DeviceTime arrived, bool transforms) {
  std::vector<igtl_tdata_element> elements(birds.birds.size());
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const Bird& bird = birds.birds[i];
    igtl_tdata_element& element = elements[i];
    bird.name.copy(element.name, sizeof element.name);
    element.type = IGTL_TDATA_TYPE_6D;
    put_columns(bird.tracker_from_sensor.matrix(), element.transform);
  }
  igtl_tdata_convert_byte_order(elements.data(), static_cast<int>(elements.size()));
  const std::span body(reinterpret_cast<const std::uint8_t*>(elements.data()),
                       elements.size() * sizeof(igtl_tdata_element));
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_header(*out, "TDATA", kBirdsDevice, birds.acquired, body.size(), checksum(body));
  out->insert(out->end(), body.begin(), body.end());
  if (transforms) {
    for (const Bird& bird : birds.birds)
      append_transform(*out, transform_device(bird.name), bird.tracker_from_sensor.matrix(), birds.acquired);
  }
  return {Packet::Kind::tracking, std::move(out), nullptr, arrived};
}

std::string transform_device(const std::string& bird) {
  constexpr std::string_view kTo = "ToTracker";
  constexpr std::size_t kRoom = kMostTransformNameBytes;
  static_assert(kRoom == sizeof(igtl_header::device_name) - kTo.size());
  std::string name = bird;
  if (name.size() > kRoom) {
    std::size_t end = kRoom;
    while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) --end;  // no letter of UTF-8 is cut
    name.resize(end);
  }
  if (!name.empty() && name.front() >= 'a' && name.front() <= 'z')
    name.front() = static_cast<char>(name.front() - 'a' + 'A');
  return name.append(kTo);
}

Packet pack(const Doubt& doubt) {
  return string_packet(kDoubtDevice, doubt, doubt.acquired);
}

Packet pack(const ClockChange& change) {
  return string_packet(kClockChangeDevice, change, change.at);
}

Packet pack(const Pedal& pedal) {
  return string_packet(kPedalDevice, pedal, pedal.at);
}

Packet pack(const Status& status, DeviceTime time, const char* device) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  const auto message = igtl::StatusMessage::New();
  message->SetDeviceName(device);
  stamp(*message, time);
  message->SetCode(status.ok ? igtl::StatusMessage::STATUS_OK : igtl::StatusMessage::STATUS_NOT_READY);
  message->SetSubCode(0);
  message->SetErrorName("");
  message->SetStatusString(status.text.c_str());
  append(*out, *message);
  return {Packet::Kind::status, std::move(out), nullptr, {}};
}

Packet pack(const Health& health, DeviceTime time) {
  return string_packet(kHealthDevice, health, time);
}

Packet pack(const CameraControls& controls, DeviceTime time) {
  return string_packet(kCameraControlsDevice, controls, time);
}

Packet pack(const Calibration& calibration, DeviceTime time) {
  Packet packet = string_packet(kCalibrationDevice, calibration, time);
  packet.kind = Packet::Kind::calibration;
  return packet;
}

Packet pack(const PublishedTransform& transform) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_transform(*out, transform.name, transform.matrix, transform.time);
  return {Packet::Kind::tracking, std::move(out), nullptr, {}};
}

Packet pack(const PublishedVolume& volume) {
  igtl_image_header image{};
  image.version = IGTL_IMAGE_HEADER_VERSION;
  image.num_components = 1;
  image.scalar_type = IGTL_IMAGE_STYPE_TYPE_INT16;
  image.endian = IGTL_IMAGE_ENDIAN_LITTLE;
  image.coord = IGTL_IMAGE_COORD_RAS;
  Eigen::Vector3d middle;
  for (int i = 0; i < 3; ++i) {
    const int size = volume.size.at(static_cast<std::size_t>(i));
    image.size[i] = image.subvol_size[i] = static_cast<std::uint16_t>(size);
    middle[i] = 0.5 * (size - 1);
  }
  // The protocol's image has its place in its middle, not at the first voxel.
  Eigen::Matrix<float, 3, 4> columns;
  columns << volume.ras_from_voxel.linear().cast<float>(), (volume.ras_from_voxel * middle).cast<float>();
  std::copy_n(columns.data(), 12, image.matrix);
  igtl_image_convert_byte_order(&image);
  const std::span heads(reinterpret_cast<const std::uint8_t*>(&image), sizeof image);
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_header(*out, "IMAGE", volume.name.c_str(), volume.time, heads.size() + volume.voxels->size(),
                checksum(*volume.voxels, checksum(heads)));
  out->insert(out->end(), heads.begin(), heads.end());
  return {Packet::Kind::volume, std::move(out), volume.voxels, {}};
}

Packet pack(const ClockPing& ping) {
  return string_packet(kClockPingDevice, ping, {});
}

Packet pack(const ClockPong& pong) {
  return string_packet(kClockPongDevice, pong, pong.sent);
}

Packet pack(const Subscription& subscription) {
  return string_packet(kSubscribeDevice, subscription, {});
}

Packet pack(const CameraLock& lock) {
  return string_packet(kCameraLockDevice, lock, {});
}

Packet pack_tracking_request() {
  const std::vector<std::uint8_t> body(IGTL_STT_TDATA_SIZE);  // no least interval, no name of a coordinate system
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_header(*out, "STT_TDATA", "", {}, body.size(), checksum(body));
  out->insert(out->end(), body.begin(), body.end());
  return {Packet::Kind::other, std::move(out), nullptr, {}};
}

Packet pack_status_request() {
  // An extended header of 12 bytes: its size, that of the meta data's index, that of the meta data, a number. No
  // content; of the index only its count, none.
  constexpr std::array<std::uint8_t, 14> kBody{0, 12, 0, 2};
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_header(*out, "GET_STATUS", "", {}, kBody.size(), checksum(kBody), 2);
  out->insert(out->end(), kBody.begin(), kBody.end());
  return {Packet::Kind::other, std::move(out), nullptr, {}};
}

Packet pack_tracking_reply(bool done) {
  const std::uint8_t status = done ? 0 : 1;
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_header(*out, "RTS_TDATA", kBirdsDevice, {}, 1, checksum({&status, 1}));
  out->push_back(status);
  return {Packet::Kind::other, std::move(out), nullptr, {}};
}

}  // namespace birdseye::wire
