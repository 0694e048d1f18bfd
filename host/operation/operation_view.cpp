#include "host/operation/operation_view.hpp"

#include "host/texts/texts.hpp"

namespace birdseye::host {

std::optional<Eigen::Vector3d> first_place_mm(const OperationView& operation) {
  const bool fiducials = operation.step == LiveStep::fiducials || operation.landmarks.empty();
  if (fiducials && !operation.markers_in_patient_mm.empty()) return operation.markers_in_patient_mm.front();
  if (operation.landmarks.empty()) return std::nullopt;
  return operation.landmarks.front().place_mm;
}

std::string primary_words(const OperationView& operation) {
  if (operation.frozen) return words("do_let_go");
  if (operation.asks_for_instruments) return words("do_same_instruments");
  if (!operation.patient_fault.empty()) return words("do_other_ct");
  if (operation.asks_for_patient) return words("do_confirm_patient");
  const bool done = operation.note(operation.step).done;
  switch (operation.step) {
    case LiveStep::connect:
      return operation.link.may_retry ? words("do_retry") : words("do_wait");
    case LiveStep::calibrate:
      if (done) return words("do_go_on");
      return operation.guiding ? words("do_end_stations") : words("do_begin");
    case LiveStep::fiducials:
      if (done && !operation.unconfirmed) return words("do_go_on");
      return operation.simulated ? words("do_wait_for_touches") : words("do_take_point");
    case LiveStep::views:
      return done ? words("do_go_on") : words("do_keep_view");
    case LiveStep::deform:
      if (done && !operation.organ_moved) return words("do_go_on");
      return operation.deforming ? words("do_wait_for_match") : words("do_match");
    case LiveStep::check:
      return operation.unconfirmed ? words("do_landmarks_fit") : words("do_go_on");
    case LiveStep::run:
      return operation.overlay_hidden ? words("do_show") : words("do_hide");
  }
  return {};
}

}  // namespace birdseye::host
