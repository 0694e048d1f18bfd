#include "calibration/geometry/camera_parameters.hpp"

namespace birdseye {

CameraVector parameters_of(const CameraModel& c) {
  CameraVector p;
  p << c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.k3;
  return p;
}

void set_parameters(CameraModel& c, const double* p) {
  c.fx_px = p[0];
  c.fy_px = p[1];
  c.cx_px = p[2];
  c.cy_px = p[3];
  c.k1 = p[4];
  c.k2 = p[5];
  c.p1 = p[6];
  c.p2 = p[7];
  c.k3 = p[8];
}

}  // namespace birdseye
