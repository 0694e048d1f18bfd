#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// Work on bytes from elsewhere: what it gives is sent back. It may end its process, and must need no file.
using ConfinedWork = std::string (*)(std::string_view input);

/// What work makes of the input, in a process of its own that is confined to what the input's size justifies
/// (confine_to_bytes). From any thread; one after the other. What comes back is not to be trusted. Errors: no process
/// is free, or it cannot be confined, and did nothing; how the process ended; Errc::bad_value: it gave more than
/// most_bytes. Their words go on from a file's name.
Result<std::string> run_confined(ConfinedWork work, std::string_view input, std::size_t most_bytes);

/// The processes of run_confined are copies of one that stands by, made now or else by the first run_confined. Made
/// while this process has one thread, it inherits no lock of a library (OpenCV) that another thread would have to open.
void stand_by_to_confine();

}  // namespace birdseye::host
