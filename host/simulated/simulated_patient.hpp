#pragma once

#include <array>

namespace birdseye::host {

/// The labels of the simulated patient's segmentation, as the simulator says them in its truth.json.
struct SimulatedLabels {
  static constexpr int kLiver = 1, kPortal = 2, kHepatic = 3, kTumour = 4;
  /// What the overlay shows: vessels and tumour.
  static constexpr std::array kShown{kPortal, kHepatic, kTumour};
  /// What the video shows.
  static constexpr std::array kOrgan{kLiver, kPortal, kHepatic, kTumour};
};

}  // namespace birdseye::host
