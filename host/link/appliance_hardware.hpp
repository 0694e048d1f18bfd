#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "calibration/record/calibration_record.hpp"

namespace birdseye::host {

/// What an appliance's instruments say they are, by their names ("tracker", "camera").
using Hardware = std::map<std::string, calibration::Identity>;

/// Asks the appliance at HOST:PORT, and waits some seconds until all that are named run. Errors: no appliance, one
/// whose instrument does not run, with its reason.
Result<Hardware> ask_hardware(const std::string& address, const std::vector<std::string>& names);

/// An error where the record is bound to hardware other than this.
Result<void> check_hardware(const calibration::CalibrationRecord& record, const Hardware& told);

/// The same of a record's file and an appliance that runs, before a calibration of the latter is entered into the
/// former. A file that is not there yet, or is bound to none, goes with any.
Result<void> check_bound_record(const std::filesystem::path& record, const std::string& address,
                                const std::vector<std::string>& names);

}  // namespace birdseye::host
