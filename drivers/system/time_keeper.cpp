#include "drivers/system/time_keeper.hpp"

namespace birdseye {

namespace {

// Of the one thread that a simulator's fibers are of: what runs beside it, as who watches standard input, is not its
// own.
thread_local TimeKeeper* keeper_in_place = nullptr;

}  // namespace

TimeKeeper* TimeKeeper::present() {
  return keeper_in_place;
}

void TimeKeeper::put(TimeKeeper* keeper) {
  keeper_in_place = keeper;
}

}  // namespace birdseye
