#pragma once

#include <memory>
#include <string>

#include "calibration/base/result.hpp"

struct gpiod_chip;

namespace birdseye::drivers {

struct ChipCloser {
  void operator()(gpiod_chip* chip) const;  ///< which gives back its lines
};
using GpioChip = std::unique_ptr<gpiod_chip, ChipCloser>;

/// name: /dev/gpiochip0, gpiochip0, or its label. The error says why it cannot be opened.
Result<GpioChip> open_gpio_chip(const std::string& name);

/// How many lines it has, and what it calls some of them, for who has misnamed one.
std::string line_names_of(gpiod_chip* chip);

/// The chip's name and label, its lines, and which of them somebody uses, as one reads it without asking for a line.
Result<std::string> describe_gpio_chip(const std::string& name);

}  // namespace birdseye::drivers
