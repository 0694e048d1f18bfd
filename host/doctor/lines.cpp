#include "host/doctor/lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kLines = "tracker lines";
constexpr std::uint16_t kFtdi = 0x0403;
constexpr const char* kRules = "install packaging/60-birdseye.rules as /etc/udev/rules.d/60-birdseye.rules";

std::uint16_t hex_number(const std::string& text) {
  std::uint16_t number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number, 16);
  return number;
}

/// A PC's kernel makes ttyS0 to ttyS3 whether there are ports or not: of those that are none it does not know the chip.
bool has_port(const Machine& machine, const std::string& tty) {
  const fs::path folder = machine.at("/sys/class/tty/" + tty);
  std::error_code ignored;
  return fs::exists(folder / "device", ignored) && first_line(folder / "type") != "0";
}

/// What is said of a line that may be used.
std::string held_words(const Holders& holders) {
  if (!holders.programs.empty()) return fmt::format("held by {}", fmt::join(holders.programs, ", "));
  return holders.all_seen ? "free" : "whether a program of another user holds it is not known";
}

Check check_port(const Machine& machine, const std::string& device) {
  Check check{kLines, device, CheckState::good, "", ""};
  if (const auto refused = refusal(machine, device)) {
    // Most PCs have such a port and nothing on it.
    const bool on_board = device.starts_with("/dev/ttyS");
    check.state = on_board ? CheckState::could_be_better : CheckState::bad;
    check.found = refused->found;
    check.remedy = (on_board ? "only if the tracker is on it: " : "") + refused->remedy;
    return check;
  }
  const Holders holders = holders_of(machine, device);
  check.found = "may be used; " + held_words(holders);
  const std::string timer = first_line(machine.at("/sys/class/tty/" + device.substr(5) + "/device/latency_timer"));
  if (!timer.empty()) check.found += fmt::format("; FTDI adapter, latency timer {} ms", timer);
  if (!holders.programs.empty()) {
    check.state = CheckState::could_be_better;
    check.remedy = "if birdseyed is to have it and this is another program, stop that one: one program a line";
  } else if (!timer.empty() && timer != "1" && timer != "2") {
    check.state = CheckState::could_be_better;
    check.remedy = fmt::format("{}: poses then come after 1 ms and not after {}", kRules, timer);
  }
  return check;
}

Check check_adapter(const Machine& machine, const UsbDevice& device) {
  const drivers::UsbCandidate& one = device.candidate;
  Check check{kLines,
              fmt::format("usb:{:04x}:{:04x}{}{}", one.vendor, one.product, one.serial.empty() ? "" : ":", one.serial),
              CheckState::good, one.product_text.empty() ? "FTDI adapter" : one.product_text, ""};
  if (const auto refused = refusal(machine, device.node)) {
    check.state = CheckState::bad;
    check.found += fmt::format(", {}: {}", device.node, refused->found);
    check.remedy = refused->remedy;
    return check;
  }
  const Holders holders = holders_of(machine, device.node);
  check.found += ", may be used over USB; " + held_words(holders);
  return check;
}

/// It asks every new line whether it is a modem, and holds it meanwhile.
std::vector<Check> check_modem_manager(const Machine& machine) {
  if (processes_named(machine, "ModemManager").empty()) return {};
  std::error_code ignored;
  for (const char* folder : {"/etc/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"}) {
    if (fs::exists(machine.at(folder) / "60-birdseye.rules", ignored)) return {};
  }
  return {{kLines, "ModemManager", CheckState::could_be_better, "runs, and sends bytes to lines that are plugged in",
           fmt::format("{}, which keeps it off the tracker's, or remove the package modemmanager", kRules)}};
}

std::vector<Check> no_line() {
  return {{kLines, "lines", CheckState::missing, "no serial port and no FTDI adapter",
           "plug in the tracker's adapter; where an appliance has the tracker, give --server HOST:PORT"}};
}

}  // namespace

std::vector<std::string> serial_ports(const Machine& machine) {
  std::vector<std::string> ports;
  for (const std::string& tty : names_in(machine.at("/sys/class/tty"))) {
    if (has_port(machine, tty)) ports.push_back("/dev/" + tty);
  }
  return ports;
}

std::vector<UsbDevice> usb_devices(const Machine& machine) {
  std::vector<UsbDevice> devices;
  for (const std::string& name : names_in(machine.at("/sys/bus/usb/devices"))) {
    const fs::path folder = machine.at("/sys/bus/usb/devices/" + name);
    const std::string vendor = first_line(folder / "idVendor");
    if (vendor.empty()) continue;  // an interface of a device
    UsbDevice device;
    device.candidate = {hex_number(vendor), hex_number(first_line(folder / "idProduct")),
                        first_line(folder / "product"), first_line(folder / "serial")};
    device.node =
        fmt::format("/dev/bus/usb/{:0>3}/{:0>3}", first_line(folder / "busnum"), first_line(folder / "devnum"));
    devices.push_back(std::move(device));
  }
  return devices;
}

std::vector<Question> line_questions(const Machine& machine) {
  std::vector<Question> questions;
  for (const std::string& port : serial_ports(machine))
    questions.push_back({.area = kLines, .name = port, .ask = [machine, port] {
                           return std::vector<Check>{check_port(machine, port)};
                         }});
  for (const UsbDevice& device : usb_devices(machine)) {
    if (device.candidate.vendor != kFtdi) continue;
    questions.push_back({.area = kLines, .name = device.node, .ask = [machine, device] {
                           return std::vector<Check>{check_adapter(machine, device)};
                         }});
  }
  if (questions.empty()) questions.push_back({.area = kLines, .name = "lines", .ask = no_line});
  questions.push_back(
      {.area = kLines, .name = "ModemManager", .ask = [machine] { return check_modem_manager(machine); }});
  return questions;
}

}  // namespace birdseye::host
