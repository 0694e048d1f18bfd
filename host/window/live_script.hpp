#pragma once

#include <Eigen/Core>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "host/operation/operation_view.hpp"

namespace birdseye::host {

/// Keys pressed and pictures taken without a hand: a line each of
///   wait STEP SECONDS                 until that step is done; fails after so long
///   wait overlay SECONDS              until a frame bears an overlay with the target in view; fails after so long
///   press NAME SECONDS STEP SECONDS   that key every so often until that step is done; fails after so long
///   sleep SECONDS
///   key NAME                          as LiveWindow's keys: space, enter, backspace, a letter
///   look X Y Z                        the slices' cross-hair at that place of the CT, patient frame, mm
///   shot FILE                         the window as a PNG
///   end
/// and remarks after #.
class LiveScript {
 public:
  /// An error names file and line.
  static Result<LiveScript> read(const std::filesystem::path& path);

  struct Act {
    std::string key;
    std::filesystem::path shot;
    std::optional<Eigen::Vector3d> place_mm;  ///< of the CT, for the slices' cross-hair
    bool end = false;
  };
  /// What is to be done now; at most one act a call. An error where something was waited for in vain.
  Result<Act> next(const OperationView& operation, HostTime now);

 private:
  struct Line {
    int number = 0;
    std::string verb, what;
    std::string step;  ///< that is waited for
    double seconds = 0, every_s = 0;
    Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  };
  std::string name_;
  std::deque<Line> lines_;
  std::optional<HostTime> since_;    ///< when the first line's turn came
  std::optional<HostTime> pressed_;  ///< when its key was last pressed
};

}  // namespace birdseye::host
