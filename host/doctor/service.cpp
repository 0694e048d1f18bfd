#include "host/doctor/service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "device/wire/tls.hpp"
#include "drivers/system/local_programs.hpp"
#include "host/doctor/configured.hpp"
#include "host/doctor/program_output.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kService = "appliance on this machine";
constexpr const char* kOwnConfig = "/etc/birdseye/birdseyed.toml";
constexpr Duration kProgramEnds = Duration::from_ms(4000);

/// "0100007F" as the kernel prints it, of a machine whose lowest byte comes first.
std::string ipv4_words(const std::string& hex) {
  std::array<unsigned, 4> bytes{};
  if (std::sscanf(hex.c_str(), "%2x%2x%2x%2x", &bytes[3], &bytes[2], &bytes[1], &bytes[0]) != 4) return hex;
  return fmt::format("{}.{}.{}.{}", bytes[0], bytes[1], bytes[2], bytes[3]);
}

std::vector<Check> check_program(const Machine& machine) {
  const std::vector<int> running = processes_named(machine, "birdseyed");
  if (!running.empty()) {
    return {{kService, "birdseyed", CheckState::good, fmt::format("runs (process {})", fmt::join(running, ", ")), ""}};
  }
  const std::string program = beside_us("birdseyed");
  const auto version = output_of({program, "--version"}, Deadline::after(kProgramEnds));
  Check check{kService, "birdseyed", CheckState::missing, "", ""};
  if (version && version->code == 0 && !version->lines.empty()) {
    check.found = fmt::format("{} is here and does not run", version->lines.front());
    check.remedy = "if the instruments are on this machine, start it: \"sudo systemctl start birdseyed\"";
  } else {
    check.found = "is not installed";
    check.remedy = "if the instruments are on this machine, install it: docs/manual/embedded.md";
  }
  return {check};
}

/// What systemd says of the service; nothing where there is no systemd or no such service.
std::vector<Check> check_unit(const Machine& machine) {
  std::error_code ignored;
  if (!fs::exists(machine.at("/run/systemd/system"), ignored)) return {};
  const auto shown =
      output_of({"systemctl", "show", "birdseyed", "--property=LoadState,ActiveState,NRestarts,StatusText"},
                Deadline::after(kProgramEnds));
  if (!shown) return {{kService, "service", CheckState::not_known, shown.error().what, ""}};
  std::string loaded, active, restarts, status;
  for (const std::string& line : shown->lines) {
    const auto value = [&](const std::string& key, std::string& into) {
      if (line.starts_with(key + "=")) into = line.substr(key.size() + 1);
    };
    value("LoadState", loaded);
    value("ActiveState", active);
    value("NRestarts", restarts);
    value("StatusText", status);
  }
  if (loaded != "loaded") return {};
  Check check{kService, "service", CheckState::good, fmt::format("{}{}{}", active, status.empty() ? "" : ": ", status),
              ""};
  if (active != "active") {
    check.state = CheckState::bad;
    check.remedy = "see why with \"journalctl -u birdseyed -n 50\", then \"sudo systemctl restart birdseyed\"";
  } else if (!restarts.empty() && restarts != "0") {
    check.state = CheckState::could_be_better;
    check.found += fmt::format("; systemd had to start it again {} times", restarts);
    check.remedy = "see why with \"journalctl -u birdseyed\"";
  }
  return {check};
}

std::vector<Check> check_listener(const Machine& machine) {
  const std::vector<std::string> at = listening_at(machine, kAppliancePort);
  Check check{kService, fmt::format("port {}", kAppliancePort), CheckState::not_known, "", ""};
  if (at.empty() && processes_named(machine, "birdseyed").empty()) return {};  // which has been said
  if (at.empty()) {
    check.found = "birdseyed runs, and nobody listens there: its [wire] port may be another";
    check.remedy = "give hosts the port that its configuration names, as --server HOST:PORT";
    return {check};
  }
  check.state = CheckState::good;
  check.found = fmt::format("somebody listens at {}", fmt::join(at, ", "));
  if (at.size() == 1 && at.front().starts_with("127.")) {
    check.state = CheckState::could_be_better;
    check.found += ", which programs of this machine alone can reach";
    check.remedy = "for a host at another machine, set [wire] bind to this machine's address on its network";
  }
  return {check};
}

std::vector<Check> check_config(const Machine& machine, const fs::path& config) {
  const std::string name = config.string();
  const auto checked = output_of({beside_us("birdseyed"), "--config", name, "--check"}, Deadline::after(kProgramEnds));
  if (!checked)
    return {{kService, name, CheckState::not_known, checked.error().what,
             checked.error().code == Errc::not_found ? "install birdseyed here" : "see whether it is a file"}};
  if (checked->code == 0) {
    std::vector<Check> checks{{kService, name, CheckState::good, "is sound", ""}};
    // What it says on stderr is of a record or a map that nobody known signed: refused, or used all the same.
    for (const std::string& line : checked->lines) {
      if (!line.starts_with("birdseyed: ")) continue;
      const bool is_used = line.find("UNSIGNED") != std::string::npos;
      checks.push_back({kService, "signatures", is_used ? CheckState::could_be_better : CheckState::bad,
                        line.substr(line.find(": ") + 2), "docs/manual/signatures.md says how to have it signed"});
    }
    const std::vector<Check> named = check_configured(machine, config);
    checks.insert(checks.end(), named.begin(), named.end());
    return checks;
  }
  std::vector<Check> checks;
  for (const std::string& line : checked->lines) {
    // Those are the keys of whoever asks, and not of the service's user.
    if (line.find(wire::kNeedsKey) != std::string::npos) {
      checks.push_back({kService, "keys", CheckState::not_known, line,
                        fmt::format("ask as the service's user: sudo -u birdseye env STATE_DIRECTORY=/var/lib/birdseye "
                                    "birdseyed --config {} --check",
                                    name)});
    } else {
      checks.push_back(
          {kService, "configuration", CheckState::bad, line, "docs/manual/birdseyed.md says what may be in it"});
    }
  }
  if (!checks.empty() && std::ranges::all_of(checks, [](const Check& one) { return one.name == "keys"; })) {
    const std::vector<Check> named = check_configured(machine, config);
    checks.insert(checks.end(), named.begin(), named.end());
  }
  if (checks.empty()) {
    checks.push_back({kService, name, CheckState::bad, fmt::format("birdseyed --check ends with {}", checked->code),
                      "install birdseyed anew"});
  }
  return checks;
}

}  // namespace

std::vector<std::string> listening_at(const Machine& machine, int port) {
  constexpr const char* kListens = "0A";
  const std::string wanted = fmt::format(":{:04X}", port);
  std::vector<std::string> addresses;
  for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream file(machine.at(table));
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      std::string number, local, remote, state;
      words >> number >> local >> remote >> state;
      if (state != kListens || !local.ends_with(wanted)) continue;
      const std::string address = local.substr(0, local.size() - wanted.size());
      addresses.push_back(address.size() == 8 ? ipv4_words(address) : "an IPv6 address");
    }
  }
  return addresses;
}

std::vector<Question> service_questions(const Machine& machine, const fs::path& config) {
  std::vector<Question> questions{
      {.area = kService, .name = "birdseyed", .ask = [machine] { return check_program(machine); }},
      {.area = kService, .name = "service", .ask = [machine] { return check_unit(machine); }},
      {.area = kService, .name = "port", .ask = [machine] { return check_listener(machine); }}};
  std::error_code ignored;
  const fs::path own = machine.at(kOwnConfig);
  const fs::path asked = config.empty() && fs::exists(own, ignored) ? own : config;
  if (!asked.empty()) {
    questions.push_back(
        {.area = kService, .name = asked.string(), .ask = [machine, asked] { return check_config(machine, asked); }});
  }
  return questions;
}

}  // namespace birdseye::host
