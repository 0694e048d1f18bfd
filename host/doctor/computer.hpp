#pragma once

#include <filesystem>
#include <vector>

#include "host/doctor/machine.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

/// Processor, memory, disk where results go, clock, and the process that decodes files. results: a folder that is there
/// or is to be made.
std::vector<Question> computer_questions(const Machine& machine, const std::filesystem::path& results);

}  // namespace birdseye::host
