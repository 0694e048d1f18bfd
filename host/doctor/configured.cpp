#include "host/doctor/configured.hpp"

#include <fmt/format.h>

#include <toml.hpp>

#include "drivers/io/usb_address.hpp"
#include "host/doctor/cameras.hpp"
#include "host/doctor/lines.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kNamed = "instruments that the configuration names";

/// A node of /dev, and what there is instead.
Check check_node(const Machine& machine, const std::string& key, const std::string& node,
                 const std::vector<std::string>& others) {
  Check check{kNamed, fmt::format("{} {}", key, node), CheckState::good, "is there, and this user may use it", ""};
  std::error_code ignored;
  if (!fs::exists(machine.at(node), ignored)) {
    check.state = CheckState::bad;
    check.found = others.empty() ? "is not there, nor is any other"
                                 : fmt::format("is not there; there is {}", fmt::join(others, ", "));
    check.remedy = fmt::format("plug it in, or set {}", key);
  } else if (const auto refused = refusal(machine, node)) {
    check.state = CheckState::could_be_better;  // the service has a user of its own
    check.found = "is there; " + refused->found;
    check.remedy = refused->remedy;
  }
  return check;
}

Check check_usb(const Machine& machine, const std::string& key, const std::string& text) {
  Check check{kNamed, fmt::format("{} {}", key, text), CheckState::good, "is plugged in", ""};
  std::vector<drivers::UsbCandidate> candidates;
  for (const UsbDevice& device : usb_devices(machine)) candidates.push_back(device.candidate);
  const auto address = drivers::parse_usb_address(text);
  const auto chosen = address ? drivers::choose_adapter(candidates, *address) : Result<std::size_t>(address.error());
  if (chosen) return check;
  check.state = CheckState::bad;
  check.found = chosen.error().what;
  check.remedy = fmt::format("plug it in, or set {}", key);
  return check;
}

Check not_asked(const std::string& key, const std::string& text) {
  return {kNamed, fmt::format("{} {}", key, text), CheckState::not_known, "is not asked: it may serve one program only",
          "\"birdseyed --config FILE --probe\" opens it, while the service is stopped"};
}

}  // namespace

std::vector<Check> check_configured(const Machine& machine, const fs::path& config) {
  const toml::value file = toml::parse(config.string());
  const auto text = [&](const char* section, const char* key) {
    if (!file.contains(section)) return std::string();
    return toml::find_or(file.at(section), key, std::string());
  };
  std::vector<Check> checks;
  if (const std::string line = text("tracker", "device"); line.starts_with('/')) {
    checks.push_back(check_node(machine, "[tracker] device", line, serial_ports(machine)));
  } else if (line.starts_with("usb:")) {
    checks.push_back(check_usb(machine, "[tracker] device", line));
  } else if (!line.empty()) {
    checks.push_back(not_asked("[tracker] device", line));
  }
  if (const std::string camera = text("camera", "source"); camera.starts_with("v4l2:/")) {
    checks.push_back(check_node(machine, "[camera] source", camera.substr(5), camera_nodes(machine)));
  } else if (!camera.empty()) {
    checks.push_back(not_asked("[camera] source", camera));
  }
  return checks;
}

}  // namespace birdseye::host
