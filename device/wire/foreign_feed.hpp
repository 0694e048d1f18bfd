#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "calibration/time/arrival_relation.hpp"
#include "calibration/time/pose_history.hpp"
#include "device/wire/foreign_messages.hpp"

namespace birdseye::wire {

/// How far the times that a server gives to pictures and to poses may be apart: it calibrates them, and says nothing of
/// how well.
inline constexpr Duration kForeignStampSigma = Duration::from_ms(5);

/// Which devices to use of a server that is no appliance.
struct ForeignSettings {
  std::string scope_device{};  ///< the device whose poses are the scope's; empty: the only device that sends poses
  std::string
      video_device{};       ///< the device whose pictures are the scope's; empty: the only device that sends pictures
  std::string not_scope{};  ///< the pointer's device: never taken for the scope's, even where no other sends poses
  /// The name under which the scope's poses are given on; empty: all poses keep the names that the server gave.
  std::string scope_bird = "scope";
};

/// Makes what an appliance sends, frames with the scope's pose at their time, from the video and poses of another
/// OpenIGTLink server. Times are the server's; a frame waits a moment for poses from after it. What keeps the overlay
/// from being drawn is told by Status, as an appliance tells it. Bounded. Reads no clock: times are given.
class ForeignFeed {
 public:
  ForeignFeed(ForeignSettings settings, HostTime began) : settings_(std::move(settings)), began_(began) {}

  /// A message, its last byte having come at `arrived`.
  void push(const Header& header, std::span<const std::uint8_t> body, HostTime arrived);
  /// The next event that has come of the messages by now.
  std::optional<Event> next(HostTime now);
  /// When the frame that has waited longest for its pose will go without one; empty: none waits.
  [[nodiscard]] std::optional<HostTime> due() const;

  /// Relates the clocks by arrivals; empty until something came. Where a server stamps nothing, messages have the time
  /// of their arrival.
  [[nodiscard]] std::optional<RelatedTime<HostTime>> host_from_device(DeviceTime time) const;
  /// What kind of server it is, and what of it is passed over, in words.
  [[nodiscard]] std::string words() const;

 private:
  struct Tool {
    PoseHistory poses;
    std::optional<HostTime> heard;  ///< the last pose that was one
    std::optional<Bird> last;
    DeviceTime still_since;  ///< since when its pose is the last one to the bit
    bool stamped = true;
  };
  struct Waiting {
    VideoFrame frame;
    bool stamped = true;
    HostTime due;
  };
  /// The scope's tool, or why there is none.
  struct Scope {
    const std::string* name = nullptr;
    const Tool* tool = nullptr;
    std::string why;
  };

  DeviceTime time_of(const Header& header, HostTime arrived);
  void take(const Header& header, ForeignPicture picture, HostTime arrived);
  void take(const Header& header, const ForeignPoses& poses, HostTime arrived);
  void pass_over(const std::string& what);
  [[nodiscard]] bool is_other_video(const std::string& device);
  [[nodiscard]] Scope scope() const;
  [[nodiscard]] PoseAnswer pose_of(const Waiting& waiting, const Scope& scope) const;
  [[nodiscard]] std::string trouble(HostTime now) const;
  [[nodiscard]] std::string video_trouble(HostTime now) const;

  ForeignSettings settings_;
  HostTime began_;
  ArrivalRelation relation_;
  std::map<std::string, Tool> tools_;
  std::set<std::string> videos_, passed_over_;
  std::deque<Waiting> waiting_;
  std::deque<Event> events_;
  std::optional<HostTime> pictured_;
  bool pictures_stamped_ = true;
  std::string picture_fault_, damage_, told_, server_says_;
  std::uint64_t pictures_ = 0, damaged_ = 0;
};

}  // namespace birdseye::wire
