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
#include "hw-sim/operation/recordings_disk.hpp"

namespace birdseye::hw_sim {

/// The law of what an appliance records: played again, it gives to the byte what reached the host, in that order. Of an
/// appliance that lost its power, all that reached the host more than a second before.
class OperationRecording {
 public:
  OperationRecording(std::filesystem::path folder, std::uint64_t seed);

  /// As the appliance is told to record.
  [[nodiscard]] const device::RecordConfig& config() const { return config_; }
  /// An event as it reached the host.
  void take(const wire::Event& event, HostTime now);
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
  std::uint64_t judged_ = 0, found_again_ = 0;
};

}  // namespace birdseye::hw_sim
