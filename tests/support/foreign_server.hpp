#pragma once

#include <igtlImageMessage.h>
#include <igtlServerSocket.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/foreign_messages.hpp"

namespace birdseye::testing {

/// A server of tracked video as PLUS is one, on the protocol's own library: 25 pictures a second, each followed by the
/// pose of its stamp, by the time of day. What it is asked for is kept.
class ForeignServer {
 public:
  static Eigen::Isometry3d pose_at(double seconds) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(100 + 30 * std::sin(seconds), -20, 310);
    pose.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()).toRotationMatrix();
    return pose;
  }

  explicit ForeignServer(bool second_tool = false)
      : socket_(igtl::ServerSocket::New()), second_tool_(second_tool), listening_(socket_->CreateServer(0) == 0) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~ForeignServer() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    socket_->CloseSocket();
  }
  ForeignServer(const ForeignServer&) = delete;
  ForeignServer& operator=(const ForeignServer&) = delete;

  [[nodiscard]] int port() const { return listening_ ? socket_->GetServerPort() : 0; }
  [[nodiscard]] int pictures() const { return pictures_; }
  /// Whether a client sent a message of this type: STT_TDATA or STRING.
  [[nodiscard]] bool was_asked(const std::string& type) {
    return (type == "STT_TDATA" && asked_poses_) || (type == "STRING" && asked_string_);
  }
  /// Ends in the middle of a message.
  void cut_off() { cut_ = true; }

 private:
  template <typename Message>
  static bool send(igtl::Socket& to, Message& message, const igtl::TimeStamp::Pointer& stamp) {
    igtl::TimeStamp::Pointer at = stamp;
    message.SetTimeStamp(at);
    message.Pack();
    return to.Send(message.GetPackPointer(), message.GetPackSize()) != 0;
  }

  bool send_transform(igtl::Socket& to, const char* name, const Eigen::Isometry3d& pose,
                      const igtl::TimeStamp::Pointer& stamp) {
    const auto transform = igtl::TransformMessage::New();
    transform->SetDeviceName(name);
    igtl::Matrix4x4 matrix;
    for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = static_cast<float>(pose.matrix()(i / 4, i % 4));
    transform->SetMatrix(matrix);
    return send(to, *transform, stamp);
  }

  bool send_all(igtl::Socket& to) {
    const auto stamp = igtl::TimeStamp::New();
    stamp->GetTime();
    const auto image = igtl::ImageMessage::New();
    image->SetDeviceName("Image_Endo");
    image->SetDimensions(64, 48, 1);
    image->SetSpacing(0.5F, 0.5F, 1);
    image->SetScalarTypeToUint8();
    image->SetNumComponents(3);
    image->AllocateScalars();
    std::memset(image->GetScalarPointer(), 10 + pictures_ % 200, static_cast<std::size_t>(image->GetImageSize()));
    const auto text = igtl::StringMessage::New();
    text->SetDeviceName("Annotation");
    text->SetString("hello");
    if (cut_) {
      image->Pack();
      (void)to.Send(image->GetPackPointer(), image->GetPackSize() / 2);
      return false;
    }
    const Eigen::Isometry3d pose = pose_at(stamp->GetTimeStamp());
    if (!send(to, *image, stamp) || !send(to, *text, stamp)) return false;
    if (second_tool_ && !send_transform(to, "StylusToTracker", pose.inverse(), stamp)) return false;
    if (!send_transform(to, "ProbeToTracker", pose, stamp)) return false;
    ++pictures_;
    return true;
  }

  void hear(igtl::Socket& from) {
    const auto header = igtl::MessageHeader::New();
    header->InitPack();
    from.SetReceiveTimeout(35);
    const int got = from.Receive(header->GetPackPointer(), header->GetPackSize());
    from.SetReceiveTimeout(1000);
    if (got != header->GetPackSize()) return;
    header->Unpack();
    if (std::string(header->GetDeviceType()) == "STT_TDATA") asked_poses_ = true;
    if (std::string(header->GetDeviceType()) == "STRING") asked_string_ = true;
    from.Skip(header->GetBodySizeToRead());
  }

  void run(const std::stop_token& stop) {
    while (listening_ && !stop.stop_requested()) {
      const igtl::ClientSocket::Pointer client = socket_->WaitForConnection(50);
      if (client.IsNull()) continue;
      client->SetSendTimeout(1000);
      while (!stop.stop_requested() && send_all(*client)) hear(*client);
      client->CloseSocket();
      if (cut_) return;
    }
  }

  igtl::ServerSocket::Pointer socket_;
  bool second_tool_, listening_;
  std::atomic<bool> asked_poses_ = false, asked_string_ = false, cut_ = false;
  std::atomic<int> pictures_ = 0;
  std::jthread thread_;
};

}  // namespace birdseye::testing
