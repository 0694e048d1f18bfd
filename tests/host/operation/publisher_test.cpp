// The registered CT as 3D Slicer gets it.
#include "host/operation/publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <igtlClientSocket.h>

#include <thread>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "host/deform/deformed_volume.hpp"
#include "tests/support/slicer.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Slicer;
using ::testing::AllOf;
using ::testing::HasSubstr;

const Transform<Tracker, Patient> kPublishedTrackerFromPatient(
    Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix(), {300, 20, -40});
const Transform<Camera, Patient> kPublishedCameraFromPatient(
    Eigen::AngleAxisd(-1.1, Eigen::Vector3d(3, 1, 1).normalized()).toRotationMatrix(), {-5, 8, 120});

/// Oblique axes, unlike sizes and spacings, so that no mistake of order hides.
std::shared_ptr<const PatientPlan> plan() {
  auto made = std::make_shared<PatientPlan>();
  Volume& ct = made->ct;
  ct.size = {6, 5, 4};
  for (int i = 0; i < 120; ++i) ct.hu.push_back(static_cast<std::int16_t>(37 * i - 1000));
  ct.spacing_mm = {0.5, 2, 3};
  ct.patient_from_voxel.linear() =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix() * ct.spacing_mm.asDiagonal();
  ct.patient_from_voxel.translation() = Eigen::Vector3d(11, -22, 33);
  return made;
}

/// Everything moves by two millimetres along the CT's second axis: by one voxel.
DisplacementField shift(const Volume& ct) {
  DisplacementField field;
  field.size = {2, 2, 2};
  field.patient_from_lattice = ct.patient_from_voxel * Eigen::Translation3d(-50, -50, -50) * Eigen::Scaling(200.0);
  field.displacement_mm.assign(8, ct.patient_from_voxel.linear().col(1).cast<float>());
  return field;
}

/// Until it has been packed and given out.
void show(Publisher& publisher, const std::shared_ptr<const PatientPlan>& patient, const DisplacementField* field,
          std::uint64_t version, Slicer& until) {
  const int before = until.counts["IMAGE"];
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  bool came = false;
  std::jthread feeding([&](const std::stop_token& stop) {
    while (!stop.stop_requested() && !deadline.passed()) {
      publisher.show(patient, field, version);
      sleep_for(Duration::from_ms(5));
    }
  });
  came = until.receive("IMAGE", before + 1);
  ASSERT_TRUE(came);
}

PublishedFrame frame() {
  return {host_now(), kPublishedTrackerFromPatient, kPublishedCameraFromPatient};
}

TEST(Publisher, TheCtLiesInSlicersWorldWhereItLiesInThePatient) {
  auto publisher = *Publisher::listen("0");
  Slicer slicer(publisher->port());
  const auto patient = plan();
  show(*publisher, patient, nullptr, 1, slicer);
  EXPECT_EQ(slicer.volume->size, patient->ct.size);
  EXPECT_EQ(slicer.volume->voxels, patient->ct.hu);
  for (const Eigen::Vector3d& voxel : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5, 1, 3)}) {
    const Eigen::Vector3d lps = patient->ct.patient_from_voxel * voxel;
    const Eigen::Vector3d ras(-lps.x(), -lps.y(), lps.z());
    EXPECT_LT((slicer.volume->ras_from_voxel * voxel - ras).norm(), 1e-3);
  }
}

TEST(Publisher, TransformsTakeSlicersPatientToTrackerAndCamera) {
  auto publisher = *Publisher::listen("0");
  Slicer slicer(publisher->port());
  publisher->tell("");
  ASSERT_TRUE(slicer.receive("STATUS", 1)) << "it is told when it is let in";
  for (int i = 1; i <= 20; ++i) {
    publisher->show(frame());
    ASSERT_TRUE(slicer.receive("TRANSFORM", 2 * i));
  }
  EXPECT_NEAR(slicer.stamp_s, (host_now() + wall_minus_monotonic() - HostTime{}).seconds(), 1);
  ASSERT_TRUE(slicer.transforms.contains("PatientToTracker") && slicer.transforms.contains("PatientToCamera"));
  const Eigen::Vector3d lps(12, -7, 150);
  const Eigen::Vector3d ras(-12, 7, 150);
  const auto by = [&](const char* name) {
    return Eigen::Vector3d((slicer.transforms[name] * ras.homogeneous()).hnormalized());
  };
  EXPECT_LT((by("PatientToTracker") - kPublishedTrackerFromPatient * lps).norm(), 1e-3);
  EXPECT_LT((by("PatientToCamera") - kPublishedCameraFromPatient * lps).norm(), 1e-3);
}

TEST(Publisher, NoPoseGoesOutWhereNoOverlayIsDrawn) {
  auto publisher = *Publisher::listen("0");
  Slicer slicer(publisher->port());
  PublishedFrame refused = frame();
  refused.camera_from_patient.reset();
  publisher->tell("the newest pose is 300 ms old");
  ASSERT_TRUE(slicer.receive("STATUS", 1));
  EXPECT_EQ(slicer.status, "the newest pose is 300 ms old");
  for (int i = 0; i < 5; ++i) {
    publisher->tell("the newest pose is 300 ms old");
    publisher->show(refused);
  }
  ASSERT_TRUE(slicer.receive("TRANSFORM", 5));
  EXPECT_FALSE(slicer.transforms.contains("PatientToCamera"));
  EXPECT_EQ(slicer.counts["STATUS"], 1) << "it is said once";
  publisher->tell("");
  ASSERT_TRUE(slicer.receive("STATUS", 2));
  EXPECT_EQ(slicer.status, "");
}

TEST(Publisher, EachClientGetsTheCtOnceAndAgainWhenItIsDeformed) {
  auto publisher = *Publisher::listen("0");
  Slicer slicer(publisher->port());
  const auto patient = plan();
  show(*publisher, patient, nullptr, 1, slicer);
  for (int i = 0; i < 10; ++i) publisher->show(patient, nullptr, 1);
  publisher->show(frame());
  ASSERT_TRUE(slicer.receive("TRANSFORM", 1));
  EXPECT_EQ(slicer.counts["IMAGE"], 1);
  Slicer late(publisher->port());
  ASSERT_TRUE(late.receive("IMAGE", 1));
  EXPECT_EQ(late.volume->voxels, patient->ct.hu);

  const DisplacementField field = shift(patient->ct);
  show(*publisher, patient, &field, 2, slicer);
  const Volume expected = deformed_volume(patient->ct, field);
  ASSERT_NE(expected.hu, patient->ct.hu);
  EXPECT_EQ(slicer.volume->voxels, expected.hu);
  EXPECT_EQ(slicer.volume->voxels.at(expected.index(2, 1, 1)), patient->ct.at(2, 2, 1)) << "a voxel further along";
  ASSERT_TRUE(late.receive("IMAGE", 2));
  EXPECT_EQ(late.volume->voxels, expected.hu);
  show(*publisher, patient, nullptr, 3, slicer);
  EXPECT_EQ(slicer.volume->voxels, patient->ct.hu) << "undone";
}

TEST(Publisher, AClientThatDoesNotReadHoldsUpNobody) {
  auto publisher = *Publisher::listen("0");
  Slicer slow(publisher->port()), quick(publisher->port());
  const auto big = std::make_shared<PatientPlan>();
  big->ct.size = {200, 200, 200};  // 16 MB: more than what sockets hold
  big->ct.hu.assign(8'000'000, 7);
  show(*publisher, big, nullptr, 1, quick);
  constexpr int kFrames = 600;
  for (int i = 0; i < kFrames; ++i) {
    publisher->show(frame());
    ASSERT_TRUE(quick.receive("TRANSFORM", 2 * i + 2)) << i;
  }
  show(*publisher, plan(), nullptr, 2, quick);
  // The other has the volume that had begun, what is newest of the rest, and no message in parts.
  ASSERT_TRUE(slow.receive("IMAGE", 2));
  EXPECT_EQ(slow.volume->size, plan()->ct.size);
  EXPECT_LE(slow.counts["TRANSFORM"], 300);
  EXPECT_GT(slow.counts["TRANSFORM"], 0);
}

/// 127.0.0.2 is this machine too: there answers who listens on all addresses, and nobody who listens on 127.0.0.1.
TEST(Publisher, ListensToThisMachineAloneUnlessToldOtherwise) {
  const auto answers = [](const Publisher& publisher) {
    const auto socket = igtl::ClientSocket::New();
    const bool connected = socket->ConnectToServer("127.0.0.2", publisher.port()) == 0;
    socket->CloseSocket();
    return connected;
  };
  const auto alone = *Publisher::listen("0"), told = *Publisher::listen("0.0.0.0:0");
  EXPECT_FALSE(answers(*alone));
  EXPECT_TRUE(answers(*told));
}

TEST(Publisher, SaysWhyItCannotListen) {
  const auto first = *Publisher::listen("0");
  const auto second = Publisher::listen(std::to_string(first->port()));
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, Errc::in_use);
  EXPECT_THAT(second.error().what,
              AllOf(HasSubstr("--publish"), HasSubstr(std::to_string(first->port())), HasSubstr("choose another")));
  for (const char* wrong : {"", "x", "70000", "12:", "nowhere:18944", "224.0.0.1:18944", "-1"}) {
    const auto refused = Publisher::listen(wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_THAT(refused.error().what, HasSubstr("--publish"));
  }
}

}  // namespace
}  // namespace birdseye::host
