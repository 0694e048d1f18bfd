#pragma once

#include "drivers/system/thread.hpp"

namespace birdseye {

/// From here on, as long as this is held, the program ends when its standard input is closed, which is how a pipe tells
/// that whoever held its other end is gone, in whatever way: SIGTERM first, SIGKILL where that is not followed. What
/// comes on standard input is thrown away. ChildProcess::Life::ours gives such a pipe. A parent death signal would come
/// too soon: the system sends it when the thread that started the program ends.
OwnedThread end_with_standard_input();

}  // namespace birdseye
