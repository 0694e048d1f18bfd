#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/camera/laparoscope.hpp"

namespace birdseye::hw_sim {

/// Places from which a lens sees all of a board, tilted and rolled as hand-eye needs it. Fewer than so many where the
/// board does not fit into the picture.
std::vector<Transform<Marker, Camera>> stations_over(const Chessboard& board, const CameraModel& lens,
                                                     std::uint64_t seed, std::size_t so_many);

}  // namespace birdseye::hw_sim
