#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>

#include "calibration/hand_eye/rod_fit.hpp"
#include "host/calibrate/hand_eye_files.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// At what the rod of an oblique scope stood, degrees, by the picture's name, with its ending or without.
using RodAngles = std::map<std::string, double>;

/// Lines of a picture's name and an angle, separated by a comma; a first line "name,angle_deg" is passed over.
Result<RodAngles> read_rod_angles(const std::filesystem::path& path);

/// The stations of one angle, and hand-eye from them alone.
struct RodGroup {
  double angle_deg = 0;
  std::vector<calibration::HandEyeStation> stations;
  calibration::HandEyeResult result;
  Verdict verdict;
  /// The rod's model, from the reference, against this hand-eye: the turn, and at the board, straight ahead.
  double off_deg = 0, off_mm = 0;
};

struct RodCalibration {
  std::vector<RodGroup> groups;   ///< by angle
  std::size_t reference = 0;      ///< the group of most stations, the first of such
  std::optional<RodScope> scope;  ///< its zero is the reference's hand-eye; none: fault says why
  std::string fault;
  [[nodiscard]] const RodGroup& at_reference() const { return groups[reference]; }
};

/// Hand-eye for each angle, and the rod's axis from them. A station whose angle is not stated and an angle of no
/// picture are errors that name it.
Result<RodCalibration> calibrate_rod(const HandEyeRecording& recording, const RodAngles& angles);

/// What the rod adds to the verdict of its reference.
void judge_rod(const RodCalibration& rod, Verdict& verdict);
nlohmann::json rod_json(const RodCalibration& rod);
void add_rod_to(HtmlPage& page, const RodCalibration& rod);

}  // namespace birdseye::host
