#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "calibration/camera/camera_calibration.hpp"
#include "calibration/camera/stereo_calibration.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// The figures of one camera, as the manual names them.
nlohmann::json camera_json(const calibration::CameraCalibration& calibration);
nlohmann::json rejected_json(const std::vector<calibration::RejectedView>& rejected);
/// The figures that a stereo pair adds.
nlohmann::json stereo_json(const calibration::StereoCalibration& calibration);

/// Adds pictures and tables of one camera. files: the pictures that it was calibrated from, to be shown by the names of
/// its views; none where only their points were given. which: put before each heading, "" or "left camera: ".
void add_camera_to(HtmlPage& page, const calibration::CameraCalibration& calibration,
                   const std::vector<std::filesystem::path>& files, const std::string& which = {});

}  // namespace birdseye::host
