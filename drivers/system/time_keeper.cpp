#include "drivers/system/time_keeper.hpp"

#include <atomic>

namespace birdseye {

namespace {

std::atomic<TimeKeeper*> keeper_in_place = nullptr;

}  // namespace

TimeKeeper* TimeKeeper::present() {
  return keeper_in_place.load(std::memory_order_acquire);
}

void TimeKeeper::put(TimeKeeper* keeper) {
  keeper_in_place.store(keeper, std::memory_order_release);
}

}  // namespace birdseye
