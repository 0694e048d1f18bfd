#pragma once

#include <map>
#include <string>

#include "calibration/time/pose_history.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::host {

/// A bird that is fixed on patient or table, and all other poses relative to it: what comes out of here has the
/// reference's frame for the tracker's. A transmitter that is bumped then changes nothing.
class ReferenceSensor {
 public:
  /// What befell it, of which nobody but a person can say whether the registration still holds.
  enum class News {
    none,
    lost,      ///< it has not been seen for a moment
    returned,  ///< it is seen again; what it did meanwhile is not known
    moved,     ///< faster than a patient or a table moves, and the other birds did not: it came off, or was pushed
  };
  struct Relative {
    wire::Event event;
    News news = News::none;
  };

  /// By the bird's name; empty: none is used, and poses stay the tracker's. scope: the bird that frames' poses are of.
  void use(const std::string& name, const std::string& scope);
  /// The link is gone: what it does now is not seen.
  void lose();
  [[nodiscard]] bool in_use() const { return !name_.empty(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// The same event with poses relative to the reference. Birds of which no such pose is known are left out, and so is
  /// a frame's pose, with the reason.
  [[nodiscard]] Relative take(const wire::Event& event);

 private:
  Relative of_birds(const wire::Birds& birds);
  Relative of_frame(wire::VideoFrame frame);
  void begin_anew();
  News note_absence(DeviceTime at);
  [[nodiscard]] PoseAnswer scope_at(DeviceTime at, const PoseAnswer& in_tracker) const;
  [[nodiscard]] bool came_off(DeviceTime at) const;
  [[nodiscard]] std::string why_absent() const;

  std::string name_, scope_;
  std::map<std::string, PoseHistory> in_tracker_;  ///< of every bird, by name
  PoseHistory scope_in_reference_;
  bool lost_ = false;
  std::string doubt_;  ///< why the tracker gave no pose of it, as it was told last
};

}  // namespace birdseye::host
