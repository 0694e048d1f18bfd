#pragma once

#include "drivers/system/time_keeper.hpp"

namespace birdseye {

/// As long as it is there, the calling thread's time is the machine's, and a simulator's stands still: for what another
/// process does on its behalf, and the kernel tells of.
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
