#include "host/link/appliance_hardware.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/files/record_file.hpp"
#include "host/link/appliance_link.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kHardwarePatience = Duration::from_ms(10'000);
constexpr Duration kHealthPatience = Duration::from_ms(3000);

/// Why not all that are named run; empty when they do, and then their identities are in told.
std::string gather(const wire::Health& health, const std::vector<std::string>& names, Hardware& told) {
  std::string missing;
  for (const std::string& name : names) {
    const auto found = std::find_if(health.instruments.begin(), health.instruments.end(),
                                    [&](const wire::InstrumentHealth& instrument) { return instrument.name == name; });
    if (found == health.instruments.end()) {
      missing = fmt::format("it has no {}", name);
    } else if (found->state != "running") {
      missing = found->text;
    } else {
      told[name] = found->identity;
    }
  }
  return missing;
}

}  // namespace

Result<Hardware> ask_hardware(const std::string& address, const std::vector<std::string>& names) {
  auto client = connect_appliance(address);
  if (!client) return client.error();
  const Deadline deadline = Deadline::after(kHardwarePatience);
  if (auto done = (*client)->subscribe({.frames = false, .tracking = false}, deadline); !done) return done.error();
  std::string missing = "it has said nothing of its instruments";
  for (;;) {
    const auto event = (*client)->next(deadline);
    if (!event) return event.error();
    if (!*event)
      return Error{Errc::timeout, fmt::format("{}: what its hardware is, is not known: {}", address, missing)};
    const auto* health = std::get_if<wire::Health>(&**event);
    if (health == nullptr) continue;
    Hardware told;
    missing = gather(*health, names, told);
    if (missing.empty()) return told;
  }
}

Result<std::string> ask_field_doubt(const std::string& address) {
  auto client = connect_appliance(address);
  if (!client) return client.error();
  const Deadline deadline = Deadline::after(kHealthPatience);
  for (;;) {
    const auto event = (*client)->next(deadline);
    if (!event) return event.error();
    if (!*event || deadline.passed()) return std::string();
    if (const auto* health = std::get_if<wire::Health>(&**event)) return health->field_unsigned;
  }
}

Result<void> check_hardware(const calibration::CalibrationRecord& record, const Hardware& told) {
  for (const auto& [name, identity] : told) {
    const calibration::Identity& recorded = name == "tracker" ? record.tracker : record.camera;
    const std::string why = recorded.empty() ? "" : calibration::misfit(name, recorded, identity);
    if (!why.empty()) {
      return Error{
          Errc::bad_value,
          fmt::format("the record is bound to other hardware: {}; calibrate this cart into a record of its own", why)};
    }
  }
  return {};
}

Result<void> check_bound_record(const std::filesystem::path& record, const std::string& address,
                                const std::vector<std::string>& names) {
  std::error_code ignored;
  if (record.empty() || !std::filesystem::exists(record, ignored)) return {};
  const auto read = read_signed_record(record);
  if (!read) return read.error();
  if (read->record.tracker.empty() && read->record.camera.empty()) return {};
  const auto told = ask_hardware(address, names);
  if (!told) return told.error();
  if (auto fits = check_hardware(read->record, *told); !fits) return fits.error().with_context(record.string());
  return {};
}

}  // namespace birdseye::host
