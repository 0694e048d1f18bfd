#pragma once

#include <igtlServerSocket.h>
#include <igtl_header.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <stop_token>
#include <string>
#include <thread>

#include "tests/support/foreign_messages.hpp"

namespace birdseye::testing {

/// Behaves as PlusServer does: of each tracked frame an IMAGE `Image_Reference` and TRANSFORMs of its stamp, on a clock
/// of its own; TDATA to those who asked; texts beside it. Each client is answered by the highest header version that it
/// has shown, of three; from 2 on the meta data say whether a pose is valid. GET_STATUS is answered, and where no frame
/// comes STATUS keeps the connection alive, of a device without a name.
class PlusServer {
 public:
  static constexpr double kAhead_s = 3600;  // of the time of day

  static Eigen::Isometry3d pose_at(double seconds) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(100 + 30 * std::sin(seconds), -20, 310);
    pose.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()).toRotationMatrix();
    return pose;
  }

  PlusServer() : socket_(igtl::ServerSocket::New()), listening_(socket_->CreateServer(0) == 0) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~PlusServer() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    socket_->CloseSocket();
  }
  PlusServer(const PlusServer&) = delete;
  PlusServer& operator=(const PlusServer&) = delete;

  [[nodiscard]] int port() const { return listening_ ? socket_->GetServerPort() : 0; }
  /// By which its client is answered.
  [[nodiscard]] unsigned version() const { return version_; }
  /// Its tracker no longer sees the probe, and PLUS goes on sending the last matrix.
  void lose_probe() { lost_ = true; }
  /// Its instruments say nothing any more.
  void go_idle() { idle_ = true; }

 private:
  static bool send(igtl::Socket& to, const Bytes& message) {
    return to.Send(message.data(), static_cast<int>(message.size())) != 0;
  }
  [[nodiscard]] Envelope envelope(std::int64_t stamp_ns, Envelope saying) const {
    saying.stamp_ns = stamp_ns;
    saying.version = version_;
    return saying;
  }
  [[nodiscard]] Bytes status_message() const {
    Bytes content;
    put(content, 1, 2);  // OK
    put(content, 0, 8);
    put_text(content, "", 20);
    return foreign_message("STATUS", "", envelope(0, {.meta_data = {}}), content);
  }

  bool send_frame(igtl::Socket& to) {
    const std::int64_t now_ns =
        std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
            .count() +
        static_cast<std::int64_t>(kAhead_s * 1e9);
    const double at_s = static_cast<double>(now_ns) * 1e-9;
    if (!lost_) probe_ = pose_at(at_s);
    const std::string word = lost_ ? "OUT_OF_VIEW" : "OK";
    const Envelope of_probe =
        envelope(now_ns, {.meta_data = {{"TransformValid", lost_ ? "False" : "True"}, {"TransformStatus", word}}});
    const Envelope of_image =
        envelope(now_ns, {.meta_data = {{"FrameNumber", "17"}, {"ProbeToTrackerTransformStatus", word}}});
    Bytes text;
    put(text, 3, 2);
    put(text, 5, 2);
    put_text(text, "hello", 5);
    bool sent =
        send(to, image_message("Image_Reference", of_image, {.width = 64, .height = 48, .components = 1})) &&
        send(to, transform_message("ProbeToTracker", of_probe, probe_)) &&
        send(to, transform_message("StylusToTracker", envelope(now_ns, {.meta_data = {{"TransformStatus", "OK"}}}),
                                   pose_at(at_s).inverse())) &&
        send(to, foreign_message("STRING", "Annotation", envelope(now_ns, {.meta_data = {}}), text));
    if (sent && wants_tdata_) {
      Bytes element;
      put_text(element, "ProbeToTracker", 20);
      put(element, 2 << 8, 2);  // of six freedoms
      put_matrix(element, probe_);
      sent = send(
          to, foreign_message("TDATA", "", envelope(now_ns, {.meta_data = {{"ProbeToTrackerStatus", word}}}), element));
    }
    return sent;
  }

  bool answer(igtl::Socket& to, const std::string& type) {
    if (type == "GET_STATUS") return send(to, status_message());
    if (type != "STT_TDATA") return true;
    wants_tdata_ = true;
    return send(to, foreign_message("RTS_TDATA", "", envelope(0, {.meta_data = {}}), {0}));
  }
  /// Waits a frame's time for what the client asks.
  bool hear(igtl::Socket& from) {
    igtl_header header{};
    from.SetReceiveTimeout(40);
    const int got = from.Receive(&header, sizeof header);
    from.SetReceiveTimeout(1000);
    if (got <= 0) return true;
    if (got != sizeof header) return false;
    igtl_header_convert_byte_order(&header);
    const std::string type(header.name, strnlen(header.name, sizeof header.name));
    version_ = std::max(version_.load(), std::min<unsigned>(header.version, 3));
    for (std::uint64_t left = header.body_size; left > 0;) {
      char waste[256];
      const int skipped = from.Receive(waste, static_cast<int>(std::min<std::uint64_t>(left, sizeof waste)));
      if (skipped <= 0) return false;
      left -= static_cast<std::uint64_t>(skipped);
    }
    return answer(from, type);
  }

  void run(const std::stop_token& stop) {
    while (listening_ && !stop.stop_requested()) {
      const igtl::ClientSocket::Pointer client = socket_->WaitForConnection(50);
      if (client.IsNull()) continue;
      client->SetSendTimeout(1000);
      version_ = 1;
      wants_tdata_ = false;
      while (!stop.stop_requested() && (idle_ ? send(*client, status_message()) : send_frame(*client)) &&
             hear(*client)) {
      }
      client->CloseSocket();
    }
  }

  igtl::ServerSocket::Pointer socket_;
  bool listening_, wants_tdata_ = false;
  std::atomic<bool> lost_ = false, idle_ = false;
  std::atomic<unsigned> version_ = 1;
  Eigen::Isometry3d probe_ = Eigen::Isometry3d::Identity();
  std::jthread thread_;
};

}  // namespace birdseye::testing
