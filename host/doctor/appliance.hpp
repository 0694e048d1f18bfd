#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/record/calibration_record.hpp"
#include "device/wire/messages.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

/// What a server said of itself in some seconds.
struct ApplianceTold {
  std::optional<wire::Status> status;
  std::optional<wire::Health> health;
  std::optional<wire::Calibration> calibration;
  std::string peer;          ///< what it is, where it is no appliance
  bool plain = false;        ///< others on the network may read and change what comes
  std::string machine = {};  ///< by what name it is known here, by its key; empty: it has shown none
};

/// What it comes to. address: as it was named.
std::vector<Check> appliance_checks(const std::string& address, const ApplianceTold& told);

/// Why it could not be connected to, and what to do. error: of connect_appliance.
Check connection_fault(const Error& error);

/// Connects to the server, listens for some seconds without asking for video, and leaves.
Question appliance_question(const std::string& address);

/// "lens pass, hand-eye marginal, no tip, no latency"
std::string record_words(const calibration::CalibrationRecord& record);

}  // namespace birdseye::host
