#pragma once

#include <sys/types.h>

#include <optional>

#include "drivers/system/clock.hpp"

namespace birdseye {

/// The status of waitpid for a child that has ended, which is then no more; empty where it still runs at the deadline.
std::optional<int> reap(pid_t child, Deadline deadline);

}  // namespace birdseye
