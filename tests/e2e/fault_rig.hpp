#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "device/wire/client.hpp"
#include "tests/support/child.hpp"

namespace birdseye::testing {

/// A message off the wire, without its pixels, and when it came (CLOCK_MONOTONIC).
struct Seen {
  std::int64_t at_ns = 0;
  wire::Event event;
};

/// One fault of a script, as the simulator says that it befell.
struct FaultSpan {
  std::string name;
  std::int64_t begin_ns = 0, end_ns = 0;
};

/// The real birdseyed, each instrument a simulator of its own, and a client that keeps all that is said. One at a time
/// in a folder.
class FaultRig {
 public:
  struct Settings {
    std::filesystem::path folder;
    std::string tracker_faults = {}, camera_faults = {};  ///< TOML
    bool tracker = true, camera = true;                   ///< false: absent at the start
    std::string tracker_device = {};                      ///< in place of the simulator's
    std::string size = "160x120", format = "RGB3";
    std::string more = {};                 ///< of the configuration
    std::vector<std::string> within = {};  ///< what birdseyed is started by
  };
  static constexpr double kFrameRateHz = 30, kTrackerRateHz = 103.3, kNoiseMm = 0.1, kNoiseDeg = 0.05;

  explicit FaultRig(Settings settings);

  void start_tracker();
  void start_camera();
  /// Listens for so long, or until something is true after a message; false when it never was.
  bool listen(double seconds, const std::function<bool()>& until = {});

  [[nodiscard]] const std::vector<Seen>& seen() const { return seen_; }
  /// The faults that have ended, of both simulators.
  [[nodiscard]] std::vector<FaultSpan> faults();
  [[nodiscard]] const std::string& failure() const { return failure_; }  ///< empty: none
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] Child& birdseyed() { return *birdseyed_; }
  [[nodiscard]] std::string log();  ///< of birdseyed
  [[nodiscard]] std::string config_path() const { return (settings_.folder / "cart.toml").string(); }
  [[nodiscard]] std::string device() const { return (settings_.folder / "tty").string(); }
  /// CLOCK_MONOTONIC at the second 0 of the tracker's circle.
  [[nodiscard]] std::int64_t circle_zero_ns() const;
  /// CLOCK_MONOTONIC at the middle of the exposure of the frame with the number 0.
  [[nodiscard]] std::int64_t first_frame_ns() const;

 private:
  void connect();
  void fail(const std::string& what);
  void write(const std::string& name, const std::string& text) const;
  [[nodiscard]] std::int64_t zero_of(const std::string& name) const;

  Settings settings_;
  std::unique_ptr<Child> tracker_, camera_, birdseyed_;
  std::unique_ptr<wire::Client> client_;
  std::vector<Seen> seen_;
  std::string failure_;
  int port_ = 0;
};

std::int64_t monotonic_ns();

}  // namespace birdseye::testing
