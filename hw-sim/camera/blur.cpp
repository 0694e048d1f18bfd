#include "hw-sim/camera/blur.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace birdseye::hw_sim {

using Eigen::Vector3f;

void blur(std::vector<Vector3f>& light, int width_px, int height_px, double sigma_px) {
  const int reach = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<float> weight;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    weight.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
    sum += weight.back();
  }
  for (float& w : weight) w /= sum;
  const auto pixel = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x);
  };
  std::vector<Vector3f> from;
  const float* const middle = &weight[static_cast<std::size_t>(reach)];
  // Along x, then along y.
  for (const bool rows : {true, false}) {
    from = light;
    tbb::parallel_for(0, height_px, [&](int y) {
      for (int x = 0; x < width_px; ++x) {
        Vector3f spread = Vector3f::Zero();
        const int at = rows ? x : y;
        const int last = (rows ? width_px : height_px) - 1;
        for (int i = std::max(-reach, -at); i <= std::min(reach, last - at); ++i) {
          const std::size_t other = rows ? pixel(x + i, y) : pixel(x, y + i);
          spread += middle[i] * from[other];
        }
        light[pixel(x, y)] = spread;
      }
    });
  }
}

}  // namespace birdseye::hw_sim
