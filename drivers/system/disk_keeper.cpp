#include "drivers/system/disk_keeper.hpp"

namespace birdseye {

namespace {

thread_local DiskKeeper* disk_in_place = nullptr;  // as the time's

}  // namespace

DiskKeeper* DiskKeeper::present() {
  return disk_in_place;
}

void DiskKeeper::put(DiskKeeper* keeper) {
  disk_in_place = keeper;
}

}  // namespace birdseye
