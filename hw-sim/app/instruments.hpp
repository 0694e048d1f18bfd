#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

/// Called with the outcome of a command; main() does the rest.
using Take = std::function<void(const Result<void>&)>;

/// WIDTHxHEIGHT of 64 to 4096 pixels.
Result<void> parse_size(const std::string& text, int& width_px, int& height_px);

/// The instruments that run alone, in real time.
void add_minibird_command(CLI::App& app, const Take& take);
void add_ft232r_command(CLI::App& app, const Take& take);
void add_camera_command(CLI::App& app, const Take& take);

}  // namespace birdseye::hw_sim
