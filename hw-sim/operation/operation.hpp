#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/faults/fault_script.hpp"
#include "hw-sim/operation/operation_laws.hpp"
#include "hw-sim/time/virtual_time.hpp"

namespace birdseye::hw_sim {

struct SimulatedOperation {
  std::uint64_t seed = 1;  ///< all that is random follows from it
  double minutes = 10;
  std::optional<FaultScript> faults{};  ///< what befalls; none: drawn by the seed
  bool programs_end = true;             ///< drawn faults also cut the network, and end programs and start them again
  bool disk_fails = true;               ///< and the disk of the window's machine is late, is full, or loses power
  /// And the network is slow, the window stands still, the table is tilted, and the scope is exchanged for another,
  /// which has a record of its own; with pictures, the scope turns in its holder, the lens is zoomed, the organ is cut.
  bool more_befalls = true;
  std::optional<bool> records{};    ///< the appliance records, and loses its power; none: the seed decides
  std::optional<bool> reference{};  ///< a reference bird is fixed on the patient; none: the seed decides
  bool pictures = false;            ///< the video shows what the scope sees; else it is grey all over, and small
};

/// What came of it.
struct OperationOutcome {
  std::vector<BrokenLaw> broken;
  OperationLaws::Figures laws;
  VirtualTimeFigures time;
  bool reference = false;  ///< there was a reference bird
  std::size_t registrations = 0, deformations = 0, checks = 0;
  std::uint64_t recordings = 0, found_again = 0;  ///< recordings that were judged, and what of the host's was in them
  FaultScript faults;                             ///< that befell
  std::string log;                                ///< what happened, a line each
  std::uint64_t hash = 0;  ///< of every event that reached the host, and of all that was on the screen
};

/// One operation from power-on to the last frame, in virtual time: the tracker, the camera, the
/// appliance, the wire, and the window's workflow up to what it decides of each frame, as the programs have them; and a
/// surgeon. The same operation gives the same outcome.
Result<OperationOutcome> run_operation(const SimulatedOperation& operation);

}  // namespace birdseye::hw_sim
