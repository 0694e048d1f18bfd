#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>

#include "calibration/hand_eye/rod_fit.hpp"
#include "host/calibrate/hand_eye_files.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// The angle of an oblique scope's rod, degrees, by the name of the picture, with its ending or without.
using RodAngles = std::map<std::string, double>;

/// Reads lines of a picture's name and an angle, separated by a comma; a first line "name,angle_deg" is passed over.
Result<RodAngles> read_rod_angles(const std::filesystem::path& path);

/// The stations of one angle, and hand-eye from them alone.
struct RodGroup {
  double angle_deg = 0;
  std::vector<calibration::HandEyeStation> stations;
  calibration::HandEyeResult result;
  Verdict verdict;
  /// By how much the rod's model, turned from the reference, misses this group's hand-eye: in turn, and at the board
  /// straight ahead.
  double off_deg = 0, off_mm = 0;
};

struct RodCalibration {
  std::vector<RodGroup> groups;   ///< by angle
  std::size_t reference = 0;      ///< the group of most stations, the first of such
  std::optional<RodScope> scope;  ///< its zero is the reference's hand-eye; none: fault says why
  std::string fault;
  [[nodiscard]] const RodGroup& at_reference() const { return groups[reference]; }
};

/// Hand-eye for each angle, and the rod's axis from them. A station without a stated angle, and an angle that belongs
/// to no picture, are errors that name it.
Result<RodCalibration> calibrate_rod(const HandEyeRecording& recording, const RodAngles& angles);

/// Adds the rod's figures to the verdict of its reference.
void judge_rod(const RodCalibration& rod, Verdict& verdict);
nlohmann::json rod_json(const RodCalibration& rod);
void add_rod_to(HtmlPage& page, const RodCalibration& rod);

}  // namespace birdseye::host
