#include "host/doctor/appliance.hpp"

#include <fmt/format.h>

#include "calibration/record/record_words.hpp"
#include "host/link/appliance_link.hpp"

namespace birdseye::host {

namespace {

constexpr const char* kAppliance = "appliance";
constexpr Duration kListen = Duration::from_ms(4000);  // it says how it is once a second
constexpr Duration kWithin = Duration::from_ms(20'000);

ApplianceTold listen_to(wire::Client& client) {
  const Deadline deadline = Deadline::after(kListen);
  ApplianceTold told;
  // A server that is no appliance knows no subscription, and is listened to all the same.
  (void)client.subscribe({.frames = false, .tracking = false}, deadline);
  while (!(told.status && told.health && told.calibration)) {
    const auto event = client.next(deadline);
    if (!event || !*event) break;
    if (const auto* status = std::get_if<wire::Status>(&**event)) told.status = *status;
    if (const auto* health = std::get_if<wire::Health>(&**event)) told.health = *health;
    if (const auto* calibration = std::get_if<wire::Calibration>(&**event)) told.calibration = *calibration;
  }
  told.peer = client.peer_words();
  told.plain = client.is_plain();
  told.machine = client.machine();
  return told;
}

/// The remedy that birdseyed names for a record that knows no instruments, for this appliance.
std::string bind_command(const std::string& address) {
  return fmt::format("{} {}", calibration::kBindCommand, address);
}
bool is_unbound(const std::string& why_not) {
  return why_not.find(calibration::kBindCommand) != std::string::npos;
}

Check status_check(const wire::Status& status, const std::string& address) {
  Check check{kAppliance, "status", CheckState::good, status.text.empty() ? "all is well" : status.text, ""};
  const bool rests_on_unsigned = status.text.find("UNSIGNED") != std::string::npos;
  if (status.ok && !rests_on_unsigned) return check;
  check.state = status.ok ? CheckState::could_be_better : CheckState::bad;
  // Who signed a record or a map is no matter of the instruments.
  const bool of_signatures = rests_on_unsigned || status.text.find("accept_unsigned") != std::string::npos;
  if (is_unbound(status.text)) {
    // Where something else is wrong too, birdseyed names it first.
    check.remedy = bind_command(address);
    if (status.text.find("; calibration of scope") != std::string::npos)
      check.remedy += "; see the instruments below, too";
  } else if (of_signatures) {
    check.remedy = "docs/manual/signatures.md says how to have it signed; see the instruments below, too";
  } else if (status.text.starts_with("calibration")) {
    check.remedy = "see the calibration record below";
  } else {
    check.remedy = "see the instruments below";
  }
  return check;
}

Check instrument_check(const wire::InstrumentHealth& instrument) {
  Check check{kAppliance, instrument.name, CheckState::good, instrument.state, ""};
  if (!instrument.text.empty()) check.found += ": " + instrument.text;
  if (instrument.state == "running") return check;
  check.state = instrument.state == "starting" ? CheckState::could_be_better : CheckState::bad;
  check.remedy =
      instrument.state == "starting"
          ? "wait: a tracker may take 30 s"
          : "see its power and its cable; at the appliance \"birdseyed --config FILE --probe\" opens it, while "
            "the service is stopped";
  return check;
}

Check losses_check(const wire::Health& health) {
  Check check{kAppliance, "losses", CheckState::good, "", ""};
  check.found = fmt::format(
      "{:.1f} measurements and {:.1f} frames a second; lost {} of {} measurements, {} of {} frames; "
      "{} line errors, {} doubted poses",
      health.tracker_rate_hz, health.frame_rate_hz, health.measurements_lost, health.measurements,
      health.frames_dropped, health.frames, health.line_errors, health.doubted);
  const auto over = [](std::uint64_t lost, std::uint64_t of) { return lost > 10 && lost * 100 > of; };
  if (over(health.line_errors, health.measurements)) {
    check.state = CheckState::could_be_better;
    check.remedy = "line errors: take another cable, look for a ground loop, compare the baud rate with the unit's";
  } else if (over(health.measurements_lost, health.measurements)) {
    check.state = CheckState::could_be_better;
    check.remedy = "lost measurements: see [tracker] rate_hz and the cable";
  } else if (over(health.frames_dropped, health.frames)) {
    check.state = CheckState::could_be_better;
    check.remedy = "lost frames: take a smaller size or rate in [camera], or another USB port";
  }
  return check;
}

Check clock_check(const wire::WallClock& clock) {
  Check check{kAppliance, "clock", CheckState::not_known, "it does not say whether a network protocol keeps its clock",
              ""};
  if (!clock.known) return check;
  check.state = CheckState::good;
  check.found = clock.synchronised ? fmt::format("kept by {}", clock.source)
                                   : "kept by no network protocol: questions over the wire relate it to this machine's";
  return check;
}

Check calibration_check(const wire::Calibration& calibration, const std::string& address) {
  Check check{kAppliance, "calibration record", CheckState::good, "", ""};
  if (!calibration.in_force) {
    check.state = CheckState::missing;  // the window can calibrate
    check.found = calibration.why_not.empty() ? "none is in force" : calibration.why_not;
    if (is_unbound(check.found)) {
      check.remedy = bind_command(address);
    } else if (check.found.find(calibration::kOfAnotherDelay) != std::string::npos) {
      check.remedy = fmt::format(
          "set [camera] delay_ms back, or birdseye calibrate latency --server {} --record FILE: "
          "docs/manual/calibrate-latency.md",
          address);
    } else {
      check.remedy = "name the scope's record in [calibration] record, or calibrate: docs/manual/calibration.md";
    }
    return check;
  }
  const auto record = calibration::parse_record(calibration.record);
  check.found = record ? fmt::format("in force: {}", record_words(*record)) : record.error().what;
  if (!record) check.state = CheckState::bad;
  if (!record) check.remedy = "take the same version of Birdseye at both ends";
  return check;
}

std::vector<Check> ask_appliance(const std::string& address) {
  const auto client = connect_appliance(address);
  if (!client) return {connection_fault(client.error())};
  return appliance_checks(address, listen_to(**client));
}

}  // namespace

Check connection_fault(const Error& error) {
  Check check{kAppliance, "connection", CheckState::bad, error.what,
              "see its power, the cable, the address and the firewall; at the appliance: \"systemctl status "
              "birdseyed\""};
  if (error.code != Errc::bad_value) return check;
  // The machine was reached, and keys or names are not as they should be: the error itself ends with the remedy.
  const std::size_t end = error.what.rfind("; ");
  if (end == std::string::npos) {
    check.remedy = "give it as 192.168.1.20:18944";
  } else {
    check.found = error.what.substr(0, end);
    check.remedy = error.what.substr(end + 2);
  }
  return check;
}

std::vector<Check> appliance_checks(const std::string& address, const ApplianceTold& told) {
  std::vector<Check> checks{{kAppliance, "connection", CheckState::good, address + " answers", ""}};
  if (!told.peer.empty()) checks.front().found = fmt::format("{} answers: {}", address, told.peer);
  if (const std::string who = answered_words(address, told.machine); !who.empty()) checks.front().found += "; " + who;
  if (told.plain) {
    checks.front().state = CheckState::could_be_better;
    checks.front().found += "; without TLS: others on the network may read and change what comes";
    checks.front().remedy =
        "pair the two machines (birdseye pair) and leave out plain:; where the other is no Birdseye, have nobody else "
        "on "
        "that network";
  }
  if (told.status) checks.push_back(status_check(*told.status, address));
  if (told.health) {
    for (const wire::InstrumentHealth& instrument : told.health->instruments)
      checks.push_back(instrument_check(instrument));
    checks.push_back(losses_check(*told.health));
    checks.push_back(clock_check(told.health->clock));
    const std::string& recording = told.health->recording;
    if (!recording.empty()) checks.push_back({kAppliance, "recording", CheckState::good, recording, ""});
  } else if (told.peer.empty()) {
    checks.front().state = CheckState::bad;
    checks.front().found = "a connection stands, and nothing of birdseyed comes over it";
    checks.front().remedy = "another program may listen there: see the port";
  }
  if (told.calibration) {
    checks.push_back(calibration_check(*told.calibration, address));
  } else if (told.health) {
    checks.push_back(
        {kAppliance, "calibration record", CheckState::missing, "it names none",
         "name the scope's record in [calibration] record, or start live with --board and calibrate there"});
  }
  return checks;
}

Question appliance_question(const std::string& address) {
  return {
      .area = kAppliance, .name = "connection", .within = kWithin, .ask = [address] { return ask_appliance(address); }};
}

std::string record_words(const calibration::CalibrationRecord& record) {
  const auto words = [](const char* name, const auto& entry) {
    return entry ? fmt::format("{} {}", name, name_of(entry->provenance.grade)) : fmt::format("no {}", name);
  };
  return fmt::format("{}, {}, {}, {}", words("lens", record.lens), words("hand-eye", record.hand_eye),
                     words("tip", record.tip), words("latency", record.latency));
}

}  // namespace birdseye::host
