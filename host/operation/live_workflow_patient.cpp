// Whose CT it is, and the places of it that a person points at.
#include <algorithm>

#include "host/operation/live_workflow.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

bool LiveWorkflow::asks_for_patient() const {
  return patient_.plan() && !patient_confirmed_ && step_ != LiveStep::connect && step_ != LiveStep::calibrate;
}

/// Another system names somebody else than the CT does.
bool LiveWorkflow::is_other_patients() const {
  return patient_.plan() && !settings_.patient_id.empty() && settings_.patient_id != patient_.plan()->identity.id;
}

void LiveWorkflow::confirm_patient() {
  if (!patient_.plan() || patient_confirmed_) return;
  if (is_other_patients()) return;  // whom another system names is not to be overruled by a key
  patient_confirmed_ = true;
  const bool touched = !fiducials_.touches().empty();
  if (!touched || patient_.markers_in_patient_mm()) {
    if (touched) fit();
    take_up();  // nothing, where that was done before
  }
  update_setup();
}

void LiveWorkflow::pick(PlacePicks::Kind kind, const Eigen::Vector3d& place_in_patient_mm) {
  if (!patient_.plan()) return;
  if (kind == PlacePicks::Kind::fiducial && !patient_.markers_in_patient_mm()) {
    pick_line_ = words("pick_too_soon");
    return;
  }
  pick_line_.clear();
  picks_.pick(kind, patient_.plan(), place_in_patient_mm);
}

void LiveWorkflow::take(const PlacePicks::Picked& picked) {
  if (picked.patient != patient_.plan()) return;
  const auto& marker = picked.marker;
  if (picked.kind == PlacePicks::Kind::landmark) {
    const std::string name =
        words("landmark_name", patient_.landmarks().size() - patient_.plan()->landmarks.size() + 1);
    const Eigen::Vector3d place_mm = marker ? marker->centre_in_patient_mm : picked.pointed_mm;
    patient_.add_landmark({name, place_mm});
    keep();
    const double off_mm = (place_mm - picked.pointed_mm).norm();
    pick_line_ = marker ? words("picked_landmark_marker", name, name_of(marker->kind), off_mm)
                        : words("picked_landmark", name, place_mm.x(), place_mm.y(), place_mm.z());
    return;
  }
  if (!marker) {
    pick_line_ = marker.error().what;
    return;
  }
  const Eigen::Vector3d& centre_mm = marker->centre_in_patient_mm;
  const auto& there = *patient_.markers_in_patient_mm();
  constexpr double kSame_mm = 3;
  const auto same = std::find_if(there.begin(), there.end(),
                                 [&](const Eigen::Vector3d& other) { return (other - centre_mm).norm() < kSame_mm; });
  if (same != there.end()) {
    pick_line_ = words("picked_twice", same - there.begin() + 1);
    return;
  }
  const auto which = patient_.add_marker(centre_mm);
  pick_line_ = words("picked_marker", which.value_or(0) + 1, name_of(marker->kind), centre_mm.x(), centre_mm.y(),
                     centre_mm.z(), (centre_mm - picked.pointed_mm).norm());
  fit_anew();
}

void LiveWorkflow::drop_marker(const Eigen::Vector3d& place_in_patient_mm) {
  const auto before = patient_.markers_in_patient_mm();
  const auto which = patient_.drop_marker(place_in_patient_mm);
  if (which && before) off_.forget_at((*before)[*which]);
  pick_line_ = which ? words("dropped_marker", *which + 1) : words("drop_none", PatientStep::kMarkerReach_mm);
  if (which) fit_anew();
}

/// A marker was added or taken away.
void LiveWorkflow::fit_anew() {
  if (fiducials_.touches().empty()) return;
  fit();
  keep();
}

}  // namespace birdseye::host
