#include "drivers/system/interrupt.hpp"

#include <signal.h>

namespace birdseye {

namespace {
std::atomic<bool> g_interrupted = false;
}

const std::atomic<bool>& note_interrupts() {
  for (const int ending : {SIGINT, SIGTERM}) {
    ::signal(ending, [](int) { g_interrupted = true; });
  }
  return g_interrupted;
}

bool interrupted() {
  return g_interrupted;
}

}  // namespace birdseye
