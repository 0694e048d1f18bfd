#pragma once

#include <vector>

#include "drivers/io/usb_address.hpp"
#include "host/doctor/machine.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

/// The serial ports behind which there is one, "/dev/ttyUSB0". None is opened: that alone would assert RTS, which holds
/// a tracker in reset.
std::vector<std::string> serial_ports(const Machine& machine);

/// A USB device as the kernel tells it, and its node.
struct UsbDevice {
  drivers::UsbCandidate candidate;
  std::string node;  ///< "/dev/bus/usb/001/004"
};
std::vector<UsbDevice> usb_devices(const Machine& machine);

/// Of each line that a tracker may be on: whether this user may use it and who has it.
std::vector<Question> line_questions(const Machine& machine);

}  // namespace birdseye::host
