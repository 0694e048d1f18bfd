#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/app/calibrate/hand_eye_files.hpp"
#include "host/app/calibrate/report_page.hpp"

namespace birdseye::host {

nlohmann::json hand_eye_json(const calibration::HandEyeResult& result, const HandEyeRecording& recording);
ReportPage hand_eye_page(const calibration::HandEyeResult& result, const HandEyeRecording& recording);

}  // namespace birdseye::host
