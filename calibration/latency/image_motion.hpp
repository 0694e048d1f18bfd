#pragma once

#include <memory>
#include <optional>
#include <string>

#include "calibration/base/image_view.hpp"
#include "calibration/latency/latency.hpp"

namespace birdseye::calibration {

/// Follows what a scope shows from picture to picture: corners by Lucas and Kanade's method, then the shift, turn and
/// growth that most of them agree on (RANSAC), so that glints and instruments are outvoted. Only what lies inside the
/// round field counts, for its border stands still whatever the scope does.
class ImageMotionTracker {
 public:
  ImageMotionTracker();
  ~ImageMotionTracker();
  ImageMotionTracker(const ImageMotionTracker&) = delete;
  ImageMotionTracker& operator=(const ImageMotionTracker&) = delete;

  /// The motion since the picture before; empty for the first one, after another size or a hole of over 0.2 s, and
  /// where too little is to be seen, of which why() tells.
  std::optional<ImageMotion> push(double time_s, const GreyView& picture);
  [[nodiscard]] const std::string& why() const { return why_; }

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::string why_;
};

}  // namespace birdseye::calibration
