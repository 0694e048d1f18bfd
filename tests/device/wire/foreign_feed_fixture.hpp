#pragma once

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

#include "device/wire/foreign_feed.hpp"
#include "device/wire/unpacker.hpp"
#include "tests/support/foreign_messages.hpp"

/// Servers that are no appliances of ours: their messages byte by byte, at times that the test makes.
namespace birdseye::wire {

using testing::Bytes;
using testing::Envelope;
using testing::ForeignImage;
using testing::image_message;
using testing::transform_message;

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kServerNs = 1'790'000'000'000'000'000;  // seconds since 1970
inline constexpr std::int64_t kHostNs = 5'000'000'000'000;            // since this machine was started
inline constexpr std::int64_t kWayNs = 2 * kMs;

inline Eigen::Isometry3d pose_at(double x_mm, double angle_rad = 0.3) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(x_mm, -20.5, 310);
  pose.linear() = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, 2, -2).normalized()).toRotationMatrix();
  return pose;
}

/// A feed, and a server whose milliseconds are those of the test.
struct FeedLink {
  explicit FeedLink(ForeignSettings settings = {}) : feed(std::move(settings), host(0)) {}
  static HostTime host(std::int64_t ms) { return {kHostNs + ms * kMs}; }
  static Envelope at(std::int64_t ms, unsigned version = 1) { return {kServerNs + ms * kMs, version}; }
  static std::int64_t ms_of(DeviceTime time) { return (time.ns - kServerNs) / kMs; }

  void push(const Bytes& message, HostTime arrived) {
    const auto header = read_header(message, kLargestBody);
    ASSERT_TRUE(header);
    feed.push(*header, std::span(message).subspan(kHeaderBytes), arrived);
  }
  /// Comes a way's time after the server's milliseconds.
  void push(const Bytes& message, std::int64_t sent_ms) { push(message, host(sent_ms) + Duration{kWayNs}); }
  void transform(const std::string& device, std::int64_t ms, const Eigen::Isometry3d& pose) {
    push(transform_message(device, at(ms), pose), ms);
  }
  void image(std::int64_t ms, const ForeignImage& picture = {}) { push(image_message("Endo", at(ms), picture), ms); }

  std::vector<Event> events(std::int64_t now_ms) {
    std::vector<Event> all;
    while (auto event = feed.next(host(now_ms))) all.push_back(*std::move(event));
    return all;
  }
  template <typename T>
  std::vector<T> of(std::int64_t now_ms) {
    std::vector<T> found;
    for (const Event& event : events(now_ms)) {
      if (const auto* one = std::get_if<T>(&event)) found.push_back(*one);
    }
    return found;
  }

  ForeignFeed feed;
};

inline double distance_mm(const PoseAnswer& pose, const Eigen::Isometry3d& expected) {
  return pose.tracker_from_sensor ? (pose.tracker_from_sensor->matrix() - expected.matrix()).cwiseAbs().maxCoeff()
                                  : 1e9;
}

}  // namespace birdseye::wire
