#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/calibrate/hand_eye_files.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

nlohmann::json hand_eye_json(const calibration::HandEyeResult& result, const HandEyeRecording& recording);
HtmlPage hand_eye_page(const calibration::HandEyeResult& result, const HandEyeRecording& recording);

}  // namespace birdseye::host
