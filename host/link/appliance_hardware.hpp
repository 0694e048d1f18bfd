#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "calibration/record/calibration_record.hpp"

namespace birdseye::host {

/// What an appliance's instruments say they are, by their names ("tracker", "camera").
using Hardware = std::map<std::string, calibration::Identity>;

/// Asks the appliance at HOST:PORT, waiting some seconds until all named instruments run. Errors: no appliance; an
/// instrument that does not run, with its reason.
Result<Hardware> ask_hardware(const std::string& address, const std::vector<std::string>& names);

/// Why nobody known answers for the map of the field by which the appliance corrects its poses; empty where somebody
/// does, where it has no such map, and where a server tells nothing of its health within 3 s. Errors: no appliance.
Result<std::string> ask_field_doubt(const std::string& address);

/// An error where the calibration record is bound to other hardware than `told`.
Result<void> check_hardware(const calibration::CalibrationRecord& record, const Hardware& told);

/// The same for a calibration record's file and an appliance that runs, before a calibration made with that appliance
/// is entered into the file. A file that is not there yet, or is bound to no hardware, goes with any appliance.
Result<void> check_bound_record(const std::filesystem::path& record, const std::string& address,
                                const std::vector<std::string>& names);

}  // namespace birdseye::host
