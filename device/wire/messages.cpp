#include "device/wire/messages.hpp"

#include <fmt/format.h>
#include <igtlImageMessage.h>
#include <igtlMessageHeader.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtl_image.h>
#include <igtl_tdata.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

namespace birdseye::wire {

namespace {

constexpr const char* kBirdsDevice = "Birds";
constexpr const char* kFrameInfoDevice = "FrameInfo";
constexpr const char* kVideoDevice = "Laparoscope";
constexpr const char* kStatusDevice = "birdseyed";
constexpr const char* kHealthDevice = "Health";

/// The standard's stamp: seconds, and a fraction in units of 2^-32 s, rounded so that nanoseconds come back exactly.
void stamp(igtl::MessageBase& message, DeviceTime time) {
  const auto seconds = static_cast<unsigned>(time.ns / 1'000'000'000);
  const auto ns = static_cast<std::uint64_t>(time.ns % 1'000'000'000);
  message.SetTimeStamp(seconds, static_cast<unsigned>(((ns << 32U) + 500'000'000) / 1'000'000'000));
}

DeviceTime stamp_of(igtl::MessageBase& message) {
  unsigned seconds = 0;
  unsigned fraction = 0;
  message.GetTimeStamp(&seconds, &fraction);
  const std::uint64_t ns = (std::uint64_t{fraction} * 1'000'000'000 + (std::uint64_t{1} << 31U)) >> 32U;
  return {std::int64_t{seconds} * 1'000'000'000 + static_cast<std::int64_t>(ns)};
}

void append(std::vector<std::uint8_t>& out, igtl::MessageBase& message) {
  message.Pack();
  const auto* bytes = static_cast<const std::uint8_t*>(message.GetPackPointer());
  out.insert(out.end(), bytes, bytes + message.GetPackSize());
}

void append_string(std::vector<std::uint8_t>& out, const char* device, const nlohmann::json& json, DeviceTime time) {
  const auto message = igtl::StringMessage::New();
  message->SetDeviceName(device);
  stamp(*message, time);
  message->SetString(json.dump().c_str());
  append(out, *message);
}

nlohmann::json json_of(const FrameInfo& info) {
  nlohmann::json pose;
  pose["kind"] = to_string(info.pose.kind);
  pose["reason"] = info.pose.reason;
  pose["sigma_mm"] = info.pose.position_sigma_mm;
  pose["age_ns"] = info.pose.age.ns;
  pose["tracker_from_scope"] = nullptr;
  if (info.pose.tracker_from_sensor) {
    const Eigen::Matrix4d m = info.pose.tracker_from_sensor->matrix();
    nlohmann::json rows = nlohmann::json::array();
    for (int i = 0; i < 16; ++i) rows.push_back(m(i / 4, i % 4));
    pose["tracker_from_scope"] = rows;
  }
  return {{"sequence", info.sequence},
          {"acquired_ns", info.acquired.ns},
          {"acquired_sigma_ns", info.acquired_sigma.ns},
          {"arrived_ns", info.arrived.ns},
          {"frames_dropped", info.frames_dropped},
          {"pose", pose}};
}

FrameInfo frame_info_of(const nlohmann::json& json) {
  FrameInfo info;
  json.at("sequence").get_to(info.sequence);
  json.at("acquired_ns").get_to(info.acquired.ns);
  json.at("acquired_sigma_ns").get_to(info.acquired_sigma.ns);
  json.at("arrived_ns").get_to(info.arrived.ns);
  json.at("frames_dropped").get_to(info.frames_dropped);
  const nlohmann::json& pose = json.at("pose");
  const auto kind = pose.at("kind").get<std::string>();
  pose.at("reason").get_to(info.pose.reason);
  pose.at("sigma_mm").get_to(info.pose.position_sigma_mm);
  pose.at("age_ns").get_to(info.pose.age.ns);
  const nlohmann::json& matrix = pose.at("tracker_from_scope");
  for (const PoseKind known : {PoseKind::exact, PoseKind::interpolated, PoseKind::predicted}) {
    if (kind != to_string(known) || matrix.size() != 16) continue;
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) m(i / 4, i % 4) = matrix[static_cast<std::size_t>(i)].get<double>();
    // A pose that is no pose is refused here, whoever sent it: nothing downstream may draw by it.
    const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
    if (!m.allFinite() || !(r * r.transpose()).isIdentity(1e-6) || r.determinant() < 0) break;
    info.pose.kind = known;
    info.pose.tracker_from_sensor = Transform<Tracker, Sensor>::from_matrix(m);
  }
  return info;
}

Result<std::optional<Event>> unpack_failed(const char* what) {
  return Error{Errc::bad_format,
               fmt::format("a {} message that does not unpack; is the other side a birdseyed?", what)};
}

/// The message of type M that the bytes hold, checked by its CRC; null where they hold none.
template <typename M>
typename M::Pointer unpacked(igtl::MessageHeader::Pointer header, std::span<const std::uint8_t> bytes) {
  auto message = M::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  const auto body = static_cast<std::size_t>(message->GetPackBodySize());
  if (body + kHeaderBytes != bytes.size()) return nullptr;
  std::memcpy(message->GetPackBodyPointer(), bytes.data() + kHeaderBytes, body);
  if ((message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) == 0) return nullptr;
  return message;
}

// The library believes the lengths inside a body, and a checksum is no proof of them: what it would follow beyond the
// end is looked at before it is let at a body.

/// A STRING's body: encoding, length, text.
bool string_is_whole(std::span<const std::uint8_t> body) {
  constexpr std::size_t kFixed = 4;
  return body.size() >= kFixed && kFixed + static_cast<std::size_t>(body[2] << 8 | body[3]) <= body.size();
}

/// A STATUS's body: code, subcode, the error's name, and text to a zero.
bool status_is_whole(std::span<const std::uint8_t> body) {
  constexpr std::size_t kFixed = 30;
  return body.size() > kFixed && body.back() == 0;
}

/// A TDATA's body: elements of equal size.
bool tracking_data_is_whole(std::span<const std::uint8_t> body) {
  return body.size() % IGTL_TDATA_ELEMENT_SIZE == 0;
}

bool image_is_whole(std::span<const std::uint8_t> body) {
  return body.size() >= IGTL_IMAGE_HEADER_SIZE;
}

/// Empty where the matrix is no pose: nothing downstream may draw by it.
std::optional<Transform<Tracker, Sensor>> pose_of(igtl::TrackingDataElement& element) {
  igtl::Matrix4x4 matrix;
  element.GetMatrix(matrix);
  Eigen::Matrix4d m;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) m(row, column) = static_cast<double>(matrix[row][column]);
  }
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  if (!m.allFinite() || !(r * r.transpose()).isIdentity(1e-4) || r.determinant() < 0) return std::nullopt;
  // Through a quaternion: single precision leaves the rotation a little off orthonormal.
  return Transform<Tracker, Sensor>(Eigen::Quaterniond(r), Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

}  // namespace

Packet pack(const VideoFrame& frame) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  out->reserve(frame.rgb->size() + 2048);
  append_string(*out, kFrameInfoDevice, json_of(frame.info), frame.info.acquired);
  const auto image = igtl::ImageMessage::New();
  image->SetDeviceName(kVideoDevice);
  image->SetDimensions(frame.width_px, frame.height_px, 1);
  image->SetSpacing(1.0F, 1.0F, 1.0F);
  image->SetScalarTypeToUint8();
  image->SetNumComponents(3);
  image->AllocateScalars();
  std::memcpy(image->GetScalarPointer(), frame.rgb->data(), frame.rgb->size());
  stamp(*image, frame.info.acquired);
  append(*out, *image);
  return out;
}

Packet pack(const Birds& birds) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  const auto message = igtl::TrackingDataMessage::New();
  message->SetDeviceName(kBirdsDevice);
  stamp(*message, birds.acquired);
  for (const Bird& bird : birds.birds) {
    auto element = igtl::TrackingDataElement::New();
    element->SetName(bird.name.c_str());
    element->SetType(igtl::TrackingDataElement::TYPE_6D);
    igtl::Matrix4x4 matrix;
    const Eigen::Matrix4d m = bird.tracker_from_sensor.matrix();
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) matrix[i][j] = static_cast<float>(m(i, j));
    }
    element->SetMatrix(matrix);
    message->AddTrackingDataElement(element);
  }
  append(*out, *message);
  return out;
}

Packet pack(const Status& status, DeviceTime time) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  const auto message = igtl::StatusMessage::New();
  message->SetDeviceName(kStatusDevice);
  stamp(*message, time);
  message->SetCode(status.ok ? igtl::StatusMessage::STATUS_OK : igtl::StatusMessage::STATUS_NOT_READY);
  message->SetErrorName("");
  message->SetStatusString(status.text.c_str());
  append(*out, *message);
  return out;
}

Packet pack(const Health& health, DeviceTime time) {
  auto out = std::make_shared<std::vector<std::uint8_t>>();
  append_string(*out, kHealthDevice,
                {{"tracker_rate_hz", health.tracker_rate_hz},
                 {"measurements", health.measurements},
                 {"phase_errors", health.phase_errors},
                 {"senseless_records", health.senseless_records},
                 {"frames", health.frames},
                 {"frames_dropped", health.frames_dropped},
                 {"messages_shed", health.messages_shed}},
                time);
  return out;
}

Result<std::uint64_t> body_bytes(std::span<const std::uint8_t> header) {
  // By hand: the library's own unpacking reports no failure. Big endian; version at 0, body size at 42.
  if (header.size() < kHeaderBytes) return Error{Errc::bad_format, "a message header that is cut short"};
  const unsigned version = header[0] * 256U + header[1];
  std::uint64_t size = 0;
  for (std::size_t i = 42; i < 50; ++i) size = size << 8U | header[i];
  if (version < 1 || version > 2 || size > kLargestBody) {
    return Error{Errc::bad_format, "the other side does not speak OpenIGTLink 2; is the port right?"};
  }
  return size;
}

Result<std::optional<Event>> Unpacker::push(std::span<const std::uint8_t> bytes) {
  const auto header = igtl::MessageHeader::New();
  header->InitPack();
  if (bytes.size() < kHeaderBytes) return unpack_failed("cut");
  std::memcpy(header->GetPackPointer(), bytes.data(), kHeaderBytes);
  header->Unpack();
  // What we send has headers of version 1; the library does not know that those of version 2 go on in the body.
  const bool ours = bytes[0] == 0 && bytes[1] == 1;
  if (!ours) return std::optional<Event>();
  const std::span<const std::uint8_t> body = bytes.subspan(kHeaderBytes);
  const std::string type = header->GetDeviceType();
  const std::string device = header->GetDeviceName();
  try {
    if (type == "STRING" && (device == kFrameInfoDevice || device == kHealthDevice)) {
      if (!string_is_whole(body)) return unpack_failed("STRING");
      const auto message = unpacked<igtl::StringMessage>(header, bytes);
      if (message == nullptr) return unpack_failed("STRING");
      const nlohmann::json json = nlohmann::json::parse(message->GetString());
      if (device == kFrameInfoDevice) {
        info_ = frame_info_of(json);
        return std::optional<Event>();
      }
      Health health;
      json.at("tracker_rate_hz").get_to(health.tracker_rate_hz);
      json.at("measurements").get_to(health.measurements);
      json.at("phase_errors").get_to(health.phase_errors);
      json.at("senseless_records").get_to(health.senseless_records);
      json.at("frames").get_to(health.frames);
      json.at("frames_dropped").get_to(health.frames_dropped);
      json.at("messages_shed").get_to(health.messages_shed);
      return std::optional<Event>(health);
    }
    if (type == "IMAGE" && device == kVideoDevice && info_) {
      if (!image_is_whole(body)) return unpack_failed("IMAGE");
      const auto message = unpacked<igtl::ImageMessage>(header, bytes);
      if (message == nullptr) return unpack_failed("IMAGE");
      VideoFrame frame;
      int depth = 0;
      message->GetDimensions(frame.width_px, frame.height_px, depth);
      const auto size = static_cast<std::int64_t>(frame.width_px) * frame.height_px * 3;
      const auto carried = static_cast<std::int64_t>(body.size()) - IGTL_IMAGE_HEADER_SIZE;
      if (frame.width_px <= 0 || frame.height_px <= 0 || depth != 1 || message->GetNumComponents() != 3 ||
          message->GetScalarType() != igtl::ImageMessage::TYPE_UINT8 || message->GetImageSize() != size ||
          carried < size) {
        return unpack_failed("IMAGE");
      }
      const auto* pixels = static_cast<const std::uint8_t*>(message->GetScalarPointer());
      frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(pixels, pixels + size);
      frame.info = *std::exchange(info_, std::nullopt);
      return std::optional<Event>(std::move(frame));
    }
    if (type == "TDATA" && device == kBirdsDevice) {
      if (!tracking_data_is_whole(body)) return unpack_failed("TDATA");
      const auto message = unpacked<igtl::TrackingDataMessage>(header, bytes);
      if (message == nullptr) return unpack_failed("TDATA");
      Birds birds;
      birds.acquired = stamp_of(*message);
      for (int i = 0; i < message->GetNumberOfTrackingDataElements(); ++i) {
        igtl::TrackingDataElement::Pointer element;
        message->GetTrackingDataElement(i, element);
        const auto pose = pose_of(*element);
        if (!pose) return unpack_failed("TDATA");
        birds.birds.push_back({element->GetName(), *pose});
      }
      return std::optional<Event>(std::move(birds));
    }
    if (type == "STATUS" && device == kStatusDevice) {
      if (!status_is_whole(body)) return unpack_failed("STATUS");
      const auto message = unpacked<igtl::StatusMessage>(header, bytes);
      if (message == nullptr) return unpack_failed("STATUS");
      return std::optional<Event>(
          Status{message->GetCode() == igtl::StatusMessage::STATUS_OK, message->GetStatusString()});
    }
  } catch (const nlohmann::json::exception&) {
    return unpack_failed("STRING");
  }
  return std::optional<Event>();
}

}  // namespace birdseye::wire
