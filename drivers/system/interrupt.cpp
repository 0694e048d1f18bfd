#include "drivers/system/interrupt.hpp"

#include <signal.h>

#include <atomic>

namespace birdseye::host {

namespace {
std::atomic<bool> g_interrupted = false;
}

void note_interrupts() {
  for (const int ending : {SIGINT, SIGTERM}) {
    ::signal(ending, [](int) { g_interrupted = true; });
  }
}

bool interrupted() {
  return g_interrupted;
}

}  // namespace birdseye::host
