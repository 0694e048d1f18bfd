#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/time_keeper.hpp"

namespace birdseye::hw_sim {

/// What virtual time did.
struct VirtualTimeFigures {
  std::int64_t elapsed_ns = 0;   ///< of virtual time
  std::uint64_t switches = 0;    ///< from a thread to another
  std::uint64_t threads = 0;     ///< that were started, the first among them
  std::uint64_t order_hash = 0;  ///< of who ran when: of two runs that are alike it is the same
};

struct VirtualTimeSettings {
  std::uint64_t seed = 1;  ///< decides who goes on where several may
  std::int64_t begins_monotonic_ns = 1'000'000'000;
  std::int64_t begins_realtime_ns = 1'790'000'000'000'000'000;
  /// So often in a row the clock may be read without a wait: who reads on waits for a time that never comes.
  std::uint64_t most_reads = 50'000'000;
};

/// Time that goes only where all wait: then it is at once the next time that somebody waits for. One thread runs at a
/// time, until it waits; who goes on then, of those that may, the seed decides. All that a thread does between two
/// waits takes no time, and parallel loops in it run to their end. So the same seed gives the same run.
///
/// Threads are fibers of the calling thread: a mutex that one of them holds while it waits for something else stops
/// them all.
///
/// work is the first thread. Gives the figures once it and all that it started have ended. Errc::timeout where all that
/// are left wait for each other: they are left as they are, and so is what they hold.
Result<VirtualTimeFigures> run_in_virtual_time(const VirtualTimeSettings& settings, std::function<void()> work);

}  // namespace birdseye::hw_sim
