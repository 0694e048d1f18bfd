#pragma once

#include <memory>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/io/byte_stream.hpp"
#include "hw-sim/minibird/endpoint.hpp"

namespace birdseye::hw_sim {

/// A line within this process: an instrument at one end, at the other a driver, which may close it and open it again.
/// What the driver does not read in time is lost beyond 64 KiB, as on a real line.
class LocalLine {
 public:
  explicit LocalLine(const std::string& name);

  /// The instrument's end, for its simulator.
  [[nodiscard]] std::unique_ptr<Endpoint> instrument() const;
  /// The driver's end. Errc::not_found while the cable is pulled, Errc::in_use while another has it.
  [[nodiscard]] Result<std::unique_ptr<drivers::ByteStream>> open() const;

  struct State;

 private:
  std::shared_ptr<State> state_;
};

}  // namespace birdseye::hw_sim
