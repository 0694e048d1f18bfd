#pragma once

#include <filesystem>
#include <string>

#include "host/operation/operation.hpp"
#include "tests/support/live_operation.hpp"

/// What the tests of the live window's workflow share.
namespace birdseye::testing {

using host::Operation;

/// With markers where kFiducials are.
inline std::string ct_with_markers(const Scratch& scratch) {
  write_ct_with_markers(scratch / "ct", kFiducials);
  return (scratch / "ct").string();
}

inline double square(double x) {
  return x * x;
}

/// By all fiducials, of this CT.
inline Operation registered_operation(const LiveSettings& settings) {
  Operation kept;
  kept.ct_sha256 = read_patient(settings.patient)->ct_sha256;
  kept.made_utc = "2026-11-22T10:00:00Z";
  kept.registered = {kTrackerFromPatient, 0.3, kFiducials, {kTracker, {}, 0}};
  return kept;
}

inline LiveSettings resumed(const Scratch& scratch, const std::filesystem::path& from) {
  LiveSettings out = operation_settings(scratch);
  out.resume = from;
  return out;
}

/// Four fiducials, and what was found of them is in out.
inline void register_into(const std::filesystem::path& out, LiveSettings kept) {
  kept.out = out;
  LiveWorkflow workflow(kept);
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(workflow.view().note(LiveStep::fiducials).done);
}

inline void register_into(const std::filesystem::path& out, const Scratch& scratch, bool with_markers = false) {
  LiveSettings kept = operation_settings(scratch);
  if (with_markers) kept.patient.ct = ct_with_markers(scratch);
  register_into(out, kept);
}

}  // namespace birdseye::testing
