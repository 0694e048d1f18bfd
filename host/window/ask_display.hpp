#pragma once

#include "host/doctor/display.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

/// Of the window that is open on this thread.
DisplayFacts facts_of_open_window();

/// Whether a window can be opened here, and what it has. A copy of this process opens one that is not shown: a display
/// that does not answer, and a driver that ends the program, are then findings.
Question display_question();

}  // namespace birdseye::host
