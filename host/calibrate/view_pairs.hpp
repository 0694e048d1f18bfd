#pragma once

#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/detect/pattern_view.hpp"

namespace birdseye::host {

/// Orders `right` so that right[i] shows the moment of left[i], by their names: partners are alike in the numbers that
/// tell one camera's pictures apart, leading zeros aside (cam0_007.png, cam1_7.png), or, where numbers do not tell
/// them apart, in the name without its ending. A picture without a partner, or with two, is an error that names it.
Result<void> pair_by_name(const std::vector<calibration::PatternView>& left,
                          std::vector<calibration::PatternView>& right);

}  // namespace birdseye::host
