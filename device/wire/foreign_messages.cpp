#include "device/wire/foreign_messages.hpp"

#include "calibration/geometry/rigid_matrix.hpp"

#include <fmt/format.h>
#include <igtl_image.h>
#include <igtl_qtdata.h>
#include <igtl_tdata.h>
#include <igtl_transform.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace birdseye::wire {

namespace {

using ByteView = std::span<const std::uint8_t>;

Error damaged(const Header& header, const std::string& how) {
  return {Errc::bad_format, fmt::format("{} \"{}\" {}", header.type, header.device, how)};
}

double number_at(ByteView bytes, std::size_t i) {
  const std::size_t at = 4 * i;
  const std::uint32_t bits = std::uint32_t{bytes[at]} << 24U | std::uint32_t{bytes[at + 1]} << 16U |
                             std::uint32_t{bytes[at + 2]} << 8U | bytes[at + 3];
  return static_cast<double>(std::bit_cast<float>(bits));
}

/// The same in all elements of lists: name, a byte for the type and one to spare.
std::string name_at(ByteView element, const std::string& otherwise) {
  const auto name = element.first(20);
  const auto end = std::find(name.begin(), name.end(), 0);
  return end == name.begin() ? otherwise : readable({name.begin(), end});
}

/// A rotation, or what single precision and a careless sender leave of one.
constexpr double kOrthonormal = 1e-3;

/// Empty where the matrix is no pose. The identity, which many send for a tool that is out of sight, is none either.
std::optional<Transform<Tracker, Sensor>> pose_of_matrix(ByteView numbers) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  for (std::size_t i = 0; i < 12; ++i) m(static_cast<int>(i % 3), static_cast<int>(i / 3)) = number_at(numbers, i);
  if (!is_rigid(m, kOrthonormal) || m.isIdentity(0)) return std::nullopt;
  return Transform<Tracker, Sensor>(Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>())),
                                    Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

/// Position, then the quaternion x y z w; of a quaternion without its w it is the positive one that makes it a unit.
std::optional<Transform<Tracker, Sensor>> pose_of_quaternion(ByteView numbers) {
  const Eigen::Vector3d position(number_at(numbers, 0), number_at(numbers, 1), number_at(numbers, 2));
  const Eigen::Vector3d xyz(number_at(numbers, 3), number_at(numbers, 4), number_at(numbers, 5));
  const double w = numbers.size() >= 28 ? number_at(numbers, 6) : std::sqrt(std::max(0.0, 1 - xyz.squaredNorm()));
  const Eigen::Quaterniond rotation(w, xyz.x(), xyz.y(), xyz.z());
  if (!position.allFinite() || position.cwiseAbs().maxCoeff() > kFarthestMm ||
      !(std::abs(rotation.norm() - 1) < kOrthonormal))
    return std::nullopt;
  if (position.isZero(0) && xyz.isZero(0)) return std::nullopt;
  return Transform<Tracker, Sensor>(rotation, position);
}

/// What PLUS and Slicer say of a pose: TransformValid ("True"), TransformStatus or Status ("OK") of a message's own,
/// NAMEStatus of an element of a list. What says nothing is taken for valid, and of what says anything only that.
bool is_valid(const std::map<std::string, std::string>& meta_data, const std::string& name) {
  const auto says = [&](const std::string& key, std::initializer_list<const char*> good) {
    const auto found = meta_data.find(key);
    return found == meta_data.end() ||
           std::any_of(good.begin(), good.end(), [&](const char* word) { return found->second == word; });
  };
  return says("TransformValid", {"True", "true", "TRUE", "1"}) && says("TransformStatus", {"OK"}) &&
         says("Status", {"OK"}) && says(name + "Status", {"OK"});
}

void add(ForeignPoses& poses, const std::string& name, const std::optional<Transform<Tracker, Sensor>>& pose) {
  if (pose) {
    poses.birds.push_back({name, *pose});
  } else {
    poses.no_poses.push_back(name);
  }
}

Result<ForeignPoses> read_transform(const Header& header, ByteView content) {
  if (content.size() != IGTL_TRANSFORM_SIZE) return damaged(header, "is cut short");
  ForeignPoses poses;
  add(poses, header.device, pose_of_matrix(content));
  return poses;
}

Result<ForeignPoses> read_list(const Header& header, ByteView content, std::size_t element_bytes) {
  if (content.size() % element_bytes != 0) return damaged(header, "is cut short");
  const bool quaternions = element_bytes == IGTL_QTDATA_ELEMENT_SIZE;
  ForeignPoses poses;
  std::set<std::string> names;
  for (; !content.empty(); content = content.subspan(element_bytes)) {
    const auto numbers = content.subspan(22, element_bytes - 22);
    const std::string name = name_at(content, header.device);
    if (names.insert(name).second) {
      add(poses, name, quaternions ? pose_of_quaternion(numbers) : pose_of_matrix(numbers));
    } else {
      poses.doubled.insert(name);
    }
  }
  // Nobody could say which of the two is that tool's.
  for (const std::string& name : poses.doubled) {
    if (std::erase_if(poses.birds, [&](const Bird& bird) { return bird.name == name; }) > 0)
      poses.no_poses.push_back(name);
  }
  return poses;
}

Result<ForeignPoses> read_position(const Header& header, ByteView content) {
  constexpr std::size_t kPlace = 12, kShort = 24, kWhole = 28;
  if (content.size() != kPlace && content.size() != kShort && content.size() != kWhole)
    return damaged(header, "is cut short");
  ForeignPoses poses;
  // A place without a direction is no pose.
  add(poses, header.device, content.size() == kPlace ? std::nullopt : pose_of_quaternion(content));
  return poses;
}

std::string pixels_in_words(const igtl_image_header& image) {
  static constexpr std::array<const char*, 12> kTypes{
      "?", "?", "8-bit signed", "8-bit",       "16-bit signed", "16-bit", "32-bit signed", "32-bit",
      "?", "?", "32-bit float", "64-bit float"};
  const char* const type = image.scalar_type < kTypes.size() ? kTypes.at(image.scalar_type) : "?";
  return fmt::format("{} voxels of {} component{}", type, image.num_components, image.num_components == 1 ? "" : "s");
}

Result<ForeignMessage> read_image(const Header& header, ByteView content) {
  if (content.size() < IGTL_IMAGE_HEADER_SIZE) return damaged(header, "is cut short");
  igtl_image_header image{};
  std::memcpy(&image, content.data(), IGTL_IMAGE_HEADER_SIZE);
  igtl_image_convert_byte_order(&image);
  const std::size_t pixels = std::size_t{image.size[0]} * image.size[1], components = image.num_components;
  if (pixels == 0 || image.size[2] == 0) return damaged(header, "has no pixels");
  if (image.size[2] > 1) return ForeignMessage(ForeignVolume{});
  if (image.scalar_type != IGTL_IMAGE_STYPE_TYPE_UINT8 || (components != 1 && components != 3)) {
    return Error{Errc::unsupported, fmt::format("IMAGE \"{}\" has {}, and 8-bit grey or RGB is read here: have the "
                                                "server send that",
                                                header.device, pixels_in_words(image))};
  }
  for (int i = 0; i < 3; ++i) {
    if (image.subvol_size[i] != image.size[i] || image.subvol_offset[i] != 0) {
      return Error{Errc::unsupported,
                   fmt::format("IMAGE \"{}\" holds a part of a picture, and whole ones are read here: have the server "
                               "send them",
                               header.device)};
    }
  }
  const auto values = content.subspan(IGTL_IMAGE_HEADER_SIZE);
  if (values.size() < pixels * components) return damaged(header, "is cut short");
  auto rgb = std::make_shared<std::vector<std::uint8_t>>(3 * pixels);
  if (components == 3) {
    std::copy_n(values.begin(), 3 * pixels, rgb->begin());
  } else {
    for (std::size_t i = 0; i < pixels; ++i)
      std::fill_n(rgb->begin() + static_cast<std::ptrdiff_t>(3 * i), 3, values[i]);
  }
  return ForeignMessage(ForeignPicture{image.size[0], image.size[1], std::move(rgb)});
}

Result<ForeignMessage> read_status(const Header& header, ByteView body) {
  constexpr unsigned kOk = 1;
  const auto status = status_of(header, body);
  if (!status) return damaged(header, "is cut short");
  if (status->code == kOk) return ForeignMessage(ForeignStatus{});
  return ForeignMessage(ForeignStatus{
      fmt::format("status {}{}{}", status->code, status->text.empty() ? "" : ": ", readable(status->text))});
}

}  // namespace

std::string readable(std::string name) {
  for (char& c : name) {
    if (c < ' ' || c > '~') c = '?';
  }
  return name;
}

Result<ForeignMessage> read_foreign(const Header& header, ByteView body) {
  const std::string& type = header.type;
  const bool image = type == "IMAGE", transform = type == "TRANSFORM", tdata = type == "TDATA";
  const bool qtdata = type == "QTDATA", position = type == "POSITION" || type == "QTRANS";
  const bool status = type == "STATUS";
  if (type == "RTS_TDATA") return ForeignMessage(ForeignAnswer{});
  if (!image && !transform && !tdata && !qtdata && !position && !status) return ForeignMessage(ForeignOther{});
  if (checksum(body) != header.crc) return damaged(header, "has a wrong checksum");
  const auto content = content_of(header, body);
  if (!content) return damaged(header, "has an extended header that lies");
  if (image) return read_image(header, *content);
  if (status) return read_status(header, body);
  const auto meta_data = meta_data_of(header, body);
  if (!meta_data) return damaged(header, "has meta data that lie");
  auto poses = tdata      ? read_list(header, *content, IGTL_TDATA_ELEMENT_SIZE)
               : qtdata   ? read_list(header, *content, IGTL_QTDATA_ELEMENT_SIZE)
               : position ? read_position(header, *content)
                          : read_transform(header, *content);
  if (!poses) return poses.error();
  std::erase_if(poses->birds, [&](const Bird& bird) {
    if (is_valid(*meta_data, bird.name)) return false;
    poses->no_poses.push_back(bird.name);
    return true;
  });
  return ForeignMessage(*std::move(poses));
}

bool is_of_appliance(const Header& header) {
  static constexpr std::array kStrings{kFrameInfoDevice, kHealthDevice,    kDoubtDevice,          kClockChangeDevice,
                                       kPedalDevice,     kClockPongDevice, kCameraControlsDevice, kCalibrationDevice};
  if (header.type == "STATUS") return header.device == kStatusDevice;
  if (header.type == "TDATA" || header.type == "RTS_TDATA") return header.device == kBirdsDevice;
  return header.type == "STRING" &&
         std::any_of(kStrings.begin(), kStrings.end(), [&](const char* name) { return header.device == name; });
}

}  // namespace birdseye::wire
