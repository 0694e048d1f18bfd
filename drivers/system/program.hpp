#pragma once

#include <string>

namespace birdseye {

/// What a program of ours tells whoever started it.
enum class ExitCode : int { success = 0, unusable_input = 2, verdict_fail = 3 };

/// Prints "program: what" as the one line on standard error that an error is, whatever names it holds.
void print_error(const std::string& program, std::string what);

}  // namespace birdseye
