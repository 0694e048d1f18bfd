#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/doctor/machine.hpp"
#include "host/doctor/question.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// What a person named; empty: not asked.
struct Examination {
  std::string server;            ///< HOST:PORT
  std::filesystem::path config;  ///< of birdseyed
  VolumeSource ct;
  std::filesystem::path record;         ///< the scope's calibration record
  std::filesystem::path results = ".";  ///< where results would go
};

/// All that is asked of the machine and of what was named, but for the window itself, which host/window asks for.
std::vector<Question> questions_of(const Machine& machine, const Examination& examination);

}  // namespace birdseye::host
