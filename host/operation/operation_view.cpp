#include "host/operation/operation_view.hpp"

namespace birdseye::host {

std::string primary_words(const OperationView& operation) {
  const bool done = operation.note(operation.step).done;
  switch (operation.step) {
    case LiveStep::connect:
      return "wait for the appliance";
    case LiveStep::calibrate:
      if (done) return "go on";
      return operation.guiding ? "end with the stations so far" : "begin";
    case LiveStep::fiducials:
      return done ? "go on" : "take this point";
    case LiveStep::views:
      return done ? "go on" : "keep this view";
    case LiveStep::deform:
      if (done && !operation.organ_moved) return "go on";
      return operation.deforming ? "cancel" : "match the CT with the views";
    case LiveStep::check:
      return operation.unconfirmed ? "the landmarks fit: go on" : "go on";
    case LiveStep::run:
      return operation.frozen           ? "let the picture go"
             : operation.overlay_hidden ? "show the overlay"
                                        : "hide the overlay";
  }
  return {};
}

}  // namespace birdseye::host
