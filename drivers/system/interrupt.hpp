#pragma once

namespace birdseye::host {

/// From here on SIGINT and SIGTERM do not end the program; they are noted. Whoever works for long asks interrupted(),
/// so that what was started is stopped and what was made for the while is removed.
void note_interrupts();
bool interrupted();

}  // namespace birdseye::host
