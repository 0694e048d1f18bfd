#pragma once

#include <stdlib.h>

#include <filesystem>
#include <memory>
#include <string>

#include "calibration/record/calibration_record.hpp"
#include "host/files/authors.hpp"
#include "host/files/record_file.hpp"

namespace birdseye::testing {

/// Who writes what a test gives to programs of ours, which run on the same machine. Never whoever runs the tests.
inline const host::Authors& authors() {
  static const host::Authors own = [] {
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / "birdseye-test-identity";
    ::setenv("BIRDSEYE_IDENTITY", folder.c_str(), 0);  // where nobody has said another
    return host::Authors::of_this_machine(false).value();
  }();
  return own;
}

/// As calibrate writes it.
inline std::string signed_record_text(const calibration::CalibrationRecord& record) {
  return host::record_text(record, *authors().machine);
}

}  // namespace birdseye::testing
