#pragma once

#include <string>

namespace birdseye::testing {

/// Lies in what is read before the window has anything to draw. Each gives what is said of it.

/// Labels that lie beside the CT, as another CT's do.
std::string of_labels_of_another_ct();
/// A recording whose camera is another than the calibration record's.
std::string of_a_recording_of_another_camera();
/// A map of the field of another cart's tracker. Empty where a pose is published.
std::string of_another_carts_field_map();

}  // namespace birdseye::testing
