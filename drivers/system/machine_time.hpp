#pragma once

#include "drivers/system/time_keeper.hpp"

namespace birdseye {

/// While one of these lives, its thread has the machine's time, and a simulator's time stands still. For work that
/// another process does for the thread: only the kernel tells when that is done.
class MachineTime {
 public:
  MachineTime() : keeper_(TimeKeeper::present()) { TimeKeeper::put(nullptr); }
  ~MachineTime() { TimeKeeper::put(keeper_); }
  MachineTime(const MachineTime&) = delete;
  MachineTime& operator=(const MachineTime&) = delete;

 private:
  TimeKeeper* keeper_;
};

}  // namespace birdseye
