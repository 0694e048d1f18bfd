#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <variant>

#include "device/birdseyed/record_file.hpp"
#include "device/wire/messages.hpp"
#include "hw-sim/faults/fault.hpp"
#include "hw-sim/operation/recordings_disk.hpp"

namespace birdseye::hw_sim {

/// The law of what an appliance records: played again, it gives to the byte what reached the host, in that order. Of an
/// appliance that lost its power, all that reached the host more than a second before, and twice what a sync took then.
/// Where the disk was full, all that came before that; and the appliance says within 2 s that the recording has ended.
class OperationRecording {
 public:
  OperationRecording(std::filesystem::path folder, std::uint64_t seed);

  /// As the appliance is told to record.
  [[nodiscard]] const device::RecordConfig& config() const { return config_; }
  /// An event as it reached the host.
  void take(const wire::Event& event, HostTime now);
  /// What befalls its disk now.
  void befall(const FaultTimeline& befalling, HostTime now);
  void lose_power(HostTime now);
  /// The appliance has ended: what is wrong with its recording, in words; empty: nothing. The next one's is another.
  std::string judge();

  /// How many recordings were judged, and what was found again in them.
  [[nodiscard]] std::uint64_t judged() const { return judged_; }
  [[nodiscard]] std::uint64_t found_again() const { return found_again_; }

 private:
  struct Seen {
    HostTime at;
    std::uint64_t hash;  ///< of its bytes
  };
  void listen(const wire::Event& event, HostTime now);
  [[nodiscard]] std::string wrong_with_last();
  /// Finds what was seen again. The time of the recording's last event, or why it could not be read to its end.
  [[nodiscard]] Result<DeviceTime> replay();
  void find(const wire::Event& event);
  [[nodiscard]] std::string missing(std::optional<HostTime> until) const;
  [[nodiscard]] std::string unsigned_words() const;

  ThisMachine machine_;
  RecordingsDisk disk_;
  device::RecordConfig config_;
  std::array<std::deque<Seen>, std::variant_size_v<wire::Event>> seen_;  ///< by kind
  std::array<std::size_t, std::variant_size_v<wire::Event>> found_{};    ///< of those, in their order
  std::optional<HostTime> begun_, cut_;
  std::optional<HostTime> full_;   ///< since then the disk has been full, or was
  std::optional<HostTime> wrote_;  ///< something was to be written since
  bool unsaid_ = false;            ///< later than 2 s after that nobody has said that the recording has ended
  Duration late_{0};               ///< that a sync took at most
  std::uint64_t judged_ = 0, found_again_ = 0;
};

}  // namespace birdseye::hw_sim
