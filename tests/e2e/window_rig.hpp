#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/e2e/fault_rig.hpp"
#include "tests/support/display.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/screen.hpp"

namespace birdseye::testing {

/// What was on the screen at one moment, read off its pixels.
struct Glance {
  std::int64_t at_ns = 0;                 ///< CLOCK_MONOTONIC, no later than the moment
  std::optional<std::uint32_t> exposure;  ///< the number of the frame that is shown
  bool dimmed = false;                    ///< as a picture that has stopped
  double overlaid_px = 0;                 ///< how many of the screen's pixels bear the overlay
  std::optional<double> off_mm;           ///< the overlay's middle from where the truth has it
};

/// What the window said over the picture, as it tells its clients.
struct Said {
  std::int64_t at_ns = 0;
  std::string words;  ///< why no overlay is drawn; empty: it is
};

/// Notes when a core of the machine lets nobody run.
class CoreWatch {
 public:
  CoreWatch();
  [[nodiscard]] bool stood_still(std::int64_t from_ns, std::int64_t until_ns) const;

 private:
  void watch(int core, const std::stop_token& stop);
  mutable std::mutex mutex_;
  std::vector<std::int64_t> late_ns_;
  std::vector<std::jthread> threads_;
};

/// The real `birdseye live` on a display of its own, registered by what an earlier window kept, over the real birdseyed
/// and simulated instruments. A ball is the patient: seen by the scope, which goes round it once in two seconds, it
/// moves over the picture, and the numbers that the simulated camera paints into its frames say when each was exposed.
class WindowRig {
 public:
  WindowRig(const Scratch& scratch, const std::string& tracker_faults, const std::string& camera_faults);
  ~WindowRig();
  WindowRig(const WindowRig&) = delete;
  WindowRig& operator=(const WindowRig&) = delete;

  /// Looks at the screen for so long.
  void watch(double seconds);
  /// Waits for an overlay; false where none comes.
  bool shows_overlay_within(double seconds);

  [[nodiscard]] const std::vector<Glance>& glances() const { return glances_; }
  [[nodiscard]] std::vector<Said> said();
  /// How many messages of a type it has sent to its client.
  [[nodiscard]] int sent(const std::string& type);
  [[nodiscard]] const CoreWatch& cores() const { return cores_; }
  [[nodiscard]] FaultRig& appliance() { return *appliance_; }
  /// When a frame was exposed, CLOCK_MONOTONIC.
  [[nodiscard]] std::int64_t exposed_ns(std::uint32_t number) const;
  [[nodiscard]] std::string failure();
  /// Asks it to end; its exit code.
  int end();

 private:
  struct Hearing;
  Glance look();

  CoreWatch cores_;
  Display display_;
  std::unique_ptr<Screen> screen_;
  std::unique_ptr<FaultRig> appliance_;
  std::unique_ptr<Child> window_;
  std::unique_ptr<Hearing> hearing_;
  std::vector<Glance> glances_;
  std::int64_t first_frame_ns_ = 0, circle_zero_ns_ = 0;
  std::jthread listening_;
};

}  // namespace birdseye::testing
