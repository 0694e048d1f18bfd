#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/calibrate/tip_calibration.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

nlohmann::json tip_json(const TipFound& found, const TipInput& input);
HtmlPage tip_page(const TipFound& found, const TipInput& input);

/// Three numbers that read_points takes, and in remarks what they rest on.
std::string tip_text(const TipFound& found);

/// "standard error 0.123 mm", or that there is none.
std::string tip_sigma_text(const calibration::Pivot& pivot);

/// "(1.20, 3.40, 5.60)".
std::string xyz_text(const Eigen::Vector3d& v, int digits = 2);

}  // namespace birdseye::host
