#pragma once

#include <gtest/gtest.h>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace birdseye::testing {

struct ReceivedVolume {
  std::array<int, 3> size{};
  std::vector<std::int16_t> voxels;
  Eigen::Affine3d ras_from_voxel = Eigen::Affine3d::Identity();
};

/// What 3D Slicer makes of what it is sent: read by the protocol's own library, and placed as Slicer's module for it
/// does.
class Slicer {
 public:
  explicit Slicer(int port) : socket_(igtl::ClientSocket::New()) {
    EXPECT_EQ(socket_->ConnectToServer("127.0.0.1", port), 0);
    socket_->SetReceiveTimeout(2000);
  }
  ~Slicer() { socket_->CloseSocket(); }
  Slicer(const Slicer&) = delete;
  Slicer& operator=(const Slicer&) = delete;

  /// The next message; false where none comes for two seconds.
  bool receive() {
    const auto header = igtl::MessageHeader::New();
    header->InitPack();
    if (socket_->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) return false;
    header->Unpack();
    const std::string type = header->GetDeviceType();
    ++counts[type];
    if (type == "TRANSFORM") return take(*body<igtl::TransformMessage>(header));
    if (type == "IMAGE") return take(*body<igtl::ImageMessage>(header));
    if (type != "STATUS") return false;
    const auto message = body<igtl::StatusMessage>(header);
    status = message->GetStatusString();
    status_ok = message->GetCode() == igtl::StatusMessage::STATUS_OK;
    return true;
  }
  [[nodiscard]] bool connected() const { return socket_->GetConnected() != 0; }
  /// Until there are so many of a type.
  bool receive(const std::string& type, int count) {
    while (counts[type] < count) {
      if (!receive()) return false;
    }
    return true;
  }

  std::map<std::string, int> counts;
  std::map<std::string, Eigen::Matrix4d> transforms;
  double stamp_s = 0;
  std::optional<ReceivedVolume> volume;
  std::string status;
  bool status_ok = false;

 private:
  template <typename Message>
  typename Message::Pointer body(igtl::MessageHeader::Pointer header) {
    auto message = Message::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    EXPECT_EQ(socket_->Receive(message->GetPackBodyPointer(), message->GetPackBodySize()), message->GetPackBodySize());
    EXPECT_NE(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY, 0) << "its checksum is wrong";
    return message;
  }
  bool take(igtl::TransformMessage& message) {
    igtl::Matrix4x4 matrix;
    message.GetMatrix(matrix);
    Eigen::Matrix4d& out = transforms[message.GetDeviceName()];
    for (int i = 0; i < 16; ++i) out(i / 4, i % 4) = static_cast<double>(matrix[i / 4][i % 4]);
    const auto stamp = igtl::TimeStamp::New();
    igtl::TimeStamp::Pointer at = stamp;
    message.GetTimeStamp(at);
    stamp_s = at->GetTimeStamp();
    return true;
  }
  /// As the module does: the matrix's columns are the axes, in RAS, its position the middle of the volume.
  bool take(igtl::ImageMessage& message) {
    volume.emplace();
    std::array<float, 3> spacing_mm{};
    message.GetDimensions(volume->size.data());
    message.GetSpacing(spacing_mm.data());
    igtl::Matrix4x4 matrix;
    message.GetMatrix(matrix);
    for (int column = 0; column < 3; ++column) {
      Eigen::Vector3d axis(matrix[0][column], matrix[1][column], matrix[2][column]);
      volume->ras_from_voxel.linear().col(column) =
          axis.normalized() * static_cast<double>(spacing_mm.at(static_cast<std::size_t>(column)));
    }
    const Eigen::Vector3d middle(volume->size[0] - 1, volume->size[1] - 1, volume->size[2] - 1);
    volume->ras_from_voxel.translation() = Eigen::Vector3d(matrix[0][3], matrix[1][3], matrix[2][3]) -
                                           volume->ras_from_voxel.linear() * Eigen::Vector3d(0.5 * middle);
    EXPECT_EQ(message.GetScalarType(), igtl::ImageMessage::TYPE_INT16);
    EXPECT_EQ(message.GetEndian(), igtl::ImageMessage::ENDIAN_LITTLE);
    const auto* voxels = static_cast<const std::int16_t*>(message.GetScalarPointer());
    volume->voxels.assign(voxels, voxels + message.GetImageSize() / 2);
    return true;
  }

  igtl::ClientSocket::Pointer socket_;
};

}  // namespace birdseye::testing
