#pragma once

#include <filesystem>
#include <vector>

#include "host/doctor/question.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// Whether a CT can be read. It is read whole, as the window reads it.
Question ct_question(const VolumeSource& ct);
/// Whether a file is a sound calibration record, and what is in it.
Question record_question(const std::filesystem::path& record);

}  // namespace birdseye::host
