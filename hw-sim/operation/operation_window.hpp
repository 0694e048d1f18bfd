#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "calibration/base/result.hpp"
#include "calibration/detect/pattern.hpp"
#include "host/operation/live_workflow.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

struct WindowSettings {
  host::PatientFiles patient;
  bool video_must_agree = true;                      ///< as host::LiveSettings has it
  std::optional<calibration::Pattern> pattern = {};  ///< the board to calibrate with
};

/// The window's workflow with the patient read, as the program opens it. folder: what is found is kept in it, and what
/// an earlier window kept there is taken up.
Result<std::unique_ptr<host::LiveWorkflow>> open_window(const WindowSettings& window, const OperationTruth& truth,
                                                        const host::Authors& authors,
                                                        const std::filesystem::path& folder);

/// The overlay is there, and nothing speaks against it.
bool is_whole(const host::ShownPicture& shown);

}  // namespace birdseye::hw_sim
