#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/doctor/machine.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

inline constexpr int kAppliancePort = 18944;

/// The addresses at which a program of this machine listens on a TCP port, "127.0.0.1"; none: nobody does.
std::vector<std::string> listening_at(const Machine& machine, int port);

/// The appliance's program on this machine: installed, running, heard from where, and whether its configuration is
/// sound. config: that file; empty: the service's own, where there is one.
std::vector<Question> service_questions(const Machine& machine, const std::filesystem::path& config);

}  // namespace birdseye::host
