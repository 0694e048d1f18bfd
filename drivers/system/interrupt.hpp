#pragma once

#include <atomic>

namespace birdseye {

/// From here on SIGINT and SIGTERM do not end the program; they are noted, in what this returns. Whoever works for long
/// asks interrupted(), so that what was started is stopped and what was made for the while is removed.
const std::atomic<bool>& note_interrupts();
bool interrupted();

}  // namespace birdseye
