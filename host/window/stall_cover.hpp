#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "calibration/base/image_view.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/condition.hpp"
#include "drivers/system/thread.hpp"

struct xcb_connection_t;

namespace birdseye::host {

/// Covers a window of the X server when its program stands still: what it drew last would else stay, and pass for live.
/// A thread with its own connection to the server watches the time, so that neither a long piece of work nor a driver
/// that hangs keeps it from covering. A machine that stands still as a whole is beyond it.
class StallCover {
 public:
  /// window: its number at the server of this DISPLAY. left_px: columns that are never covered. picture: what it shows,
  /// side by side and below each other. Null where there is no such server or window.
  static std::unique_ptr<StallCover> over(std::uint32_t window, int left_px, const RgbView& picture);
  ~StallCover();
  StallCover(const StallCover&) = delete;
  StallCover& operator=(const StallCover&) = delete;

  /// What is on the screen is to be believed until then; empty: for ever.
  void believe_until(std::optional<HostTime> until);
  /// Leaves the time that holds where it is the earlier.
  void believe_no_longer_than(HostTime until);
  /// Before something new is shown: takes it away, and returns once it is gone. What it showed stays on the screen
  /// until then.
  void lift();
  /// How often it had to cover.
  [[nodiscard]] int covered() const;

 private:
  StallCover(xcb_connection_t* server, std::uint32_t cover);
  void watch(const std::stop_token& stop);

  xcb_connection_t* server_;
  std::uint32_t cover_;
  mutable std::mutex mutex_;
  Condition earlier_;
  std::optional<HostTime> until_;
  bool covering_ = false;
  int covered_ = 0;
  OwnedThread watching_;
};

}  // namespace birdseye::host
