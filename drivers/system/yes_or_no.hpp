#pragma once

#include "drivers/system/clock.hpp"

namespace birdseye {

/// Reads a line from standard input: whether it says "y" or "yes". Anything else, and none by the deadline, is no. What
/// was typed at a terminal before it is called is no answer.
bool says_yes(Deadline deadline);

}  // namespace birdseye
