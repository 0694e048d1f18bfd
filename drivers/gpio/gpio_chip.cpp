#include "drivers/gpio/gpio_chip.hpp"

#include <fmt/format.h>
#include <gpiod.h>

#include <algorithm>
#include <cerrno>

namespace birdseye::drivers {

namespace {

constexpr std::size_t kMostNamed = 8;
constexpr unsigned kMostLines = 1024;

/// Who uses a line; null: nobody.
const char* line_user(gpiod_chip* chip, unsigned i) {
  gpiod_line* const line = gpiod_chip_get_line(chip, i);
  if (line == nullptr || !gpiod_line_is_used(line)) return nullptr;
  const char* const user = gpiod_line_consumer(line);
  return user == nullptr ? "another program" : user;
}

}  // namespace

void ChipCloser::operator()(gpiod_chip* chip) const {
  gpiod_chip_close(chip);
}

std::string line_names_of(gpiod_chip* chip) {
  std::string text;
  std::size_t named = 0;
  const unsigned count = std::min(gpiod_chip_num_lines(chip), kMostLines);
  for (unsigned i = 0; i < count && named < kMostNamed; ++i) {
    gpiod_line* line = gpiod_chip_get_line(chip, i);
    const char* name = line == nullptr ? nullptr : gpiod_line_name(line);
    if (name != nullptr) text += fmt::format("{}{}", named++ == 0 ? "" : ", ", name);
  }
  return fmt::format("{} lines{}{}", gpiod_chip_num_lines(chip), named == 0 ? ", none with a name" : ": ", text);
}

Result<GpioChip> open_gpio_chip(const std::string& name) {
  if (name.empty()) return Error{Errc::bad_value, "[gpio] chip: give /dev/gpiochipN, its name or its label"};
  if (GpioChip chip{gpiod_chip_open_lookup(name.c_str())}) return chip;
  switch (errno) {
    case EACCES:
    case EPERM:
      return Error{Errc::unreadable, fmt::format("{}: may not be opened; add this user to the group gpio", name)};
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return Error{Errc::not_found, fmt::format("{}: no such GPIO chip; see [gpio] chip and gpiodetect", name)};
    default:
      return Error{Errc::unsupported, fmt::format("{}: is no GPIO chip; see [gpio] chip and gpiodetect", name)};
  }
}

Result<std::string> describe_gpio_chip(const std::string& name) {
  const auto chip = open_gpio_chip(name);
  if (!chip) return chip.error();
  std::string text = fmt::format("{} ({}), {}", gpiod_chip_name(chip->get()), gpiod_chip_label(chip->get()),
                                 line_names_of(chip->get()));
  std::size_t told = 0;
  const unsigned count = std::min(gpiod_chip_num_lines(chip->get()), kMostLines);
  for (unsigned i = 0; i < count && told < kMostNamed; ++i) {
    const char* const user = line_user(chip->get(), i);
    if (user != nullptr) text += fmt::format("{}{} by {}", told++ == 0 ? "; used: " : ", ", i, user);
  }
  return text;
}

}  // namespace birdseye::drivers
