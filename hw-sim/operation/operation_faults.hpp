#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hw-sim/faults/fault.hpp"
#include "hw-sim/faults/fault_script.hpp"

namespace birdseye::hw_sim {

inline constexpr double kVideo_hz = 25;  ///< frames a second of an operation's camera

/// What a fault of an instrument may do to what the appliance says, and by what the appliance tells of it
/// (docs/manual/faults.md).
struct FaultSigns {
  std::vector<std::string> counters{};  ///< of Health: one of them grows
  std::vector<std::string> words{};     ///< one of them is in a STATUS, a Doubt, or an instrument's state in Health
  bool half_size = false;               ///< frames of another size come
  bool lies = false;                    ///< poses are off, and nobody can see it
  double extra_mm = 0;                  ///< poses may be off by so much more
  bool shifts_bytes = false;            ///< two of these together make one record of pieces of two: a changed reading
  double extra_s = 0;                   ///< and by as much as things move in this time
  double own_s = 0;                     ///< from its end on the instrument is not itself, as while it boots
  bool aside = false;                   ///< neither instruments nor programs are touched by it, nor how long they take
  double strikes_within_s = 0;          ///< after its begin: a fault that comes by chance has then surely come once
};

/// A reading that was changed by no more than a moving hand does is not told from one, and a predicted pose makes three
/// times of that.
inline constexpr double kUnseenChange_mm = 30;

/// Of what befalls the world: from how it was to how it is.
double takes_s(const Fault& fault);

/// Whether birdseyed ends by it, and is started at its end.
bool starts_appliance(FaultKind kind);

/// Of a fault of the tracker, the camera or a program. Nothing to be seen: both lists are empty.
FaultSigns signs_of(const Fault& fault, FaultTarget target);

/// Faults of every kind that the instruments know, alone and together, at random times from from_s on until until_s;
/// with a reference bird also the transmitter is bumped and the patient moved. All of it follows from the seed.
FaultScript draw_faults(std::uint64_t seed, double from_s, double until_s, bool reference);
/// Without a reference the video alone sees it where the transmitter is bumped: adds bumps, large enough to be seen, to
/// what befalls from from_s on until until_s, where nothing else hides their begin or their end.
void draw_bumps_in_view(std::uint64_t seed, double from_s, double until_s, FaultScript& befalls);
/// The same of the scope: it turns in its holder, or its lens is zoomed; and the organ is cut.
void draw_scope_faults_in_view(std::uint64_t seed, double from_s, double until_s, FaultScript& befalls);
/// What befalls the programs: the network is cut, the appliance or the window ends and is started again.
std::vector<Fault> draw_program_faults(std::uint64_t seed, double from_s, double until_s);
/// The network is slow from the appliance to the window, or the window stands still.
std::vector<Fault> draw_delays(std::uint64_t seed, double from_s, double until_s);
/// With a reference bird: the table is tilted.
std::vector<Fault> draw_tilts(std::uint64_t seed, double from_s, double until_s);
/// With a reference bird: it slips on what it is fixed to, in a tenth of a second.
std::vector<Fault> draw_slips(std::uint64_t seed, double from_s, double until_s);
/// The scope is exchanged for another, and for the first again.
std::vector<Fault> draw_scope_exchanges(std::uint64_t seed, double from_s, double until_s);
/// The appliance loses its power.
std::vector<Fault> draw_appliance_power_cuts(std::uint64_t seed, double from_s, double until_s);
/// The disk that the appliance records to is late, or full.
std::vector<Fault> draw_appliance_disk_faults(std::uint64_t seed, double from_s, double until_s);
/// What befalls the machine of the window: its disk is late, or full, or its power is cut.
std::vector<Fault> draw_disk_faults(std::uint64_t seed, double from_s, double until_s);

/// As read_fault_script reads it (TOML).
std::string text_of(const FaultScript& script);

}  // namespace birdseye::hw_sim
