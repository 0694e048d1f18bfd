#pragma once

#include <filesystem>
#include <memory>

#include "calibration/base/result.hpp"
#include "host/operation/live_workflow.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// The window's workflow with the patient read, as the program opens it. folder: what is found is kept in it, and what
/// an earlier window kept there is taken up.
Result<std::unique_ptr<host::LiveWorkflow>> open_window(const host::PatientFiles& patient, const OperationTruth& truth,
                                                        const host::Authors& authors,
                                                        const std::filesystem::path& folder);

}  // namespace birdseye::hw_sim
