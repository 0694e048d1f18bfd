#pragma once

#include <memory>

#include "drivers/io/usb_address.hpp"
#include "drivers/io/usb_port.hpp"

namespace birdseye::drivers {

/// What a libusb error code means for the device `name`, and what to do about it.
Error usb_error(const std::string& name, int libusb_code, const char* doing);

/// Finds the device, takes its first interface from the kernel's driver (which gets it back at the end) and claims it.
/// Nothing is sent to the device yet.
Result<std::unique_ptr<UsbPort>> open_libusb_port(const UsbAddress& address);

}  // namespace birdseye::drivers
