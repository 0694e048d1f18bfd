#pragma once

#include <string>
#include <vector>

#include "host/doctor/machine.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

/// The nodes of Video4Linux, "/dev/video0".
std::vector<std::string> camera_nodes(const Machine& machine);

/// Of each: whether this user may use it, who has it, which formats and sizes it gives. No stream is started.
std::vector<Question> camera_questions(const Machine& machine);

/// The chips of GPIO lines: strobe, pedal, LED and trigger. No line is asked for.
std::vector<Question> pin_questions(const Machine& machine);

}  // namespace birdseye::host
