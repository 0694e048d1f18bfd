#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calibration/camera/camera_calibration.hpp"
#include "calibration/camera/stereo_calibration.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// The figures of one camera, as the manual names them.
nlohmann::json camera_json(const calibration::CameraCalibration& calibration);
nlohmann::json rejected_json(const std::vector<calibration::RejectedView>& rejected);
/// The figures that a stereo pair adds.
nlohmann::json stereo_json(const calibration::StereoCalibration& calibration);

/// Adds pictures and tables of one camera. which: put before each heading, "" or "left camera: ".
void add_camera_to(HtmlPage& page, const calibration::CameraCalibration& calibration, const std::string& which = {});

}  // namespace birdseye::host
