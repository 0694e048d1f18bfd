#include "host/registration/views/view_advice.hpp"

#include <gtest/gtest.h>

#include "calibration/base/units.hpp"

namespace birdseye::host {
namespace {

/// Looks at the origin from 100 mm, from so many degrees to the right (of a viewer with the patient's z up) of -y.
Transform<Camera, Patient> from(double right_deg) {
  const double a = right_deg * kRadPerDeg;
  Eigen::Matrix3d camera_from_patient;
  camera_from_patient.row(0) = Eigen::RowVector3d(std::cos(a), std::sin(a), 0);
  camera_from_patient.row(1) = Eigen::RowVector3d(0, 0, -1);
  camera_from_patient.row(2) = Eigen::RowVector3d(-std::sin(a), std::cos(a), 0);
  return Transform<Camera, Patient>(camera_from_patient, Eigen::Vector3d(0, 0, 100));
}

TEST(ViewAdvice, TheFirstViewIsKeptWhereverItIs) {
  const ViewAdvice advice = advise_view({}, from(0), Eigen::Vector3d::Zero());
  EXPECT_FALSE(advice.look_from_deg.has_value());
  EXPECT_GT(advice.gain_now, 0.5);
}

TEST(ViewAdvice, TheSameViewAgainTellsLittleAndAnotherSideMore) {
  const std::vector<Transform<Camera, Patient>> kept{from(0)};
  const ViewAdvice again = advise_view(kept, from(0), Eigen::Vector3d::Zero());
  EXPECT_LT(again.gain_now, 0.1);
  EXPECT_GT(again.gain_best, again.gain_now + 0.3);
  EXPECT_TRUE(again.look_from_deg.has_value());
  const ViewAdvice aside = advise_view(kept, from(40), Eigen::Vector3d::Zero());
  EXPECT_GT(aside.gain_now, again.gain_now + 0.3);
}

TEST(ViewAdvice, SaysTheSideThatIsOpenAsThePictureShowsIt) {
  // Seen from the left already: what is new lies to the right.
  const std::vector<Transform<Camera, Patient>> kept{from(-20), from(-20)};
  const ViewAdvice advice = advise_view(kept, from(-10), Eigen::Vector3d::Zero());
  ASSERT_TRUE(advice.look_from_deg.has_value());
  EXPECT_GT(advice.look_from_deg->x(), 0);
  const std::vector<Transform<Camera, Patient>> other{from(20), from(20)};
  EXPECT_LT(advise_view(other, from(10), Eigen::Vector3d::Zero()).look_from_deg->x(), 0);
}

}  // namespace
}  // namespace birdseye::host
