// A bird that is fixed on patient or table: what moves the transmitter changes nothing, and what moves the bird is
// seen.
#include "host/operation/reference_sensor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "hw-sim/base/hashed.hpp"
#include "tests/support/live_operation.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect;
using birdseye::testing::give_record;
using birdseye::testing::kFiducials;
using birdseye::testing::kMs;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::load;
using birdseye::testing::operation_settings;
using birdseye::testing::Scratch;
using News = ReferenceSensor::News;

/// Where everything is in a room, and what a tracker in it measures of that.
struct Room {
  Transform<Tracker, Tracker> tracker_from_room;  ///< the transmitter, against where it stood at first
  Transform<Tracker, Patient> room_from_patient = kTrackerFromPatient;
  Transform<Patient, Sensor> patient_from_reference{rotation_exp({0.3, -0.2, 0.5}), {120, -60, 90}};
  Transform<Patient, Sensor> patient_from_scope{rotation_exp({0.1, 0.9, -0.4}), {20, 40, -300}};
  Eigen::Vector3d tip_in_patient_mm{0, 0, 200};
  bool reference_seen = true, any_seen = true;
  double noise_mm = 0, noise_deg = 0;
  std::int64_t time_ms = 1000;

  [[nodiscard]] Transform<Tracker, Sensor> seen(const Transform<Patient, Sensor>& bird, std::uint64_t which) const {
    const auto exact = tracker_from_room * room_from_patient * bird;
    const auto draw = [&](std::uint64_t i) {
      return hw_sim::hashed_normal(which, static_cast<std::uint64_t>(time_ms) * 8 + i);
    };
    return {Eigen::Matrix3d(exact.rotation() *
                            rotation_exp(noise_deg * kRadPerDeg * Eigen::Vector3d(draw(0), draw(1), draw(2)))),
            Eigen::Vector3d(exact.translation() + noise_mm * Eigen::Vector3d(draw(3), draw(4), draw(5)))};
  }
  [[nodiscard]] wire::Birds birds() const {
    wire::Birds out{DeviceTime{time_ms * kMs}, {}};
    if (!any_seen) return out;
    out.birds.push_back({"scope", seen(patient_from_scope, 1)});
    out.birds.push_back(
        {"pointer", seen({Eigen::Matrix3d::Identity(), tip_in_patient_mm - Eigen::Vector3d(0, 0, 150)}, 2)});
    if (reference_seen) out.birds.push_back({"reference", seen(patient_from_reference, 3)});
    return out;
  }
};

const wire::Bird* bird_of(const wire::Event& event, const std::string& name) {
  const auto& birds = std::get<wire::Birds>(event).birds;
  const auto found =
      std::find_if(birds.begin(), birds.end(), [&](const wire::Bird& bird) { return bird.name == name; });
  return found == birds.end() ? nullptr : &*found;
}

double apart(const Eigen::Matrix4d& a, const Eigen::Matrix4d& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

/// A sensor that follows a room for so long, 10 ms a step; what it says on the way.
struct Follower {
  Room room;
  ReferenceSensor sensor;
  std::vector<News> news;

  Follower() { sensor.use("reference", "scope"); }
  void follow(
      int steps, const std::function<void(double share)>& change = [](double) {}) {
    for (int i = 1; i <= steps; ++i) {
      room.time_ms += 10;
      change(static_cast<double>(i) / steps);
      const auto relative = sensor.take(room.birds());
      if (relative.news != News::none && (news.empty() || news.back() != relative.news)) news.push_back(relative.news);
    }
  }
};

template <typename To, typename From>
Transform<To, From> by(const Eigen::Vector3d& turn_deg, const Eigen::Vector3d& shift_mm) {
  return {rotation_exp(turn_deg * kRadPerDeg), shift_mm};
}

TEST(ReferenceSensor, ABumpedTransmitterChangesNoRelativePoseAndIsNoNews) {
  Follower at;
  at.follow(50);
  const Eigen::Matrix4d scope = bird_of(at.sensor.take(at.room.birds()).event, "scope")->tracker_from_sensor.matrix();
  const auto pointed = bird_of(at.sensor.take(at.room.birds()).event, "pointer")->tracker_from_sensor.matrix();
  at.follow(20, [&](double share) {
    at.room.tracker_from_room =
        by<Tracker, Tracker>(share * Eigen::Vector3d(3, 0, 4), share * Eigen::Vector3d(7, 16, -9));
    const auto relative = at.sensor.take(at.room.birds());
    EXPECT_LT(apart(scope, bird_of(relative.event, "scope")->tracker_from_sensor.matrix()), 1e-9);
    EXPECT_LT(apart(pointed, bird_of(relative.event, "pointer")->tracker_from_sensor.matrix()), 1e-9);
    wire::VideoFrame frame;
    frame.info.acquired = DeviceTime{(at.room.time_ms - 4) * kMs};
    frame.info.pose.kind = PoseKind::interpolated;
    frame.info.pose.tracker_from_sensor = Transform<Tracker, Sensor>();
    const auto shown = at.sensor.take(frame);
    const auto& pose = std::get<wire::VideoFrame>(shown.event).info.pose;
    ASSERT_TRUE(pose.tracker_from_sensor) << pose.reason;
    EXPECT_LT(apart(scope, pose.tracker_from_sensor->matrix()), 1e-9) << "between two measurements";
  });
  at.follow(50);
  EXPECT_TRUE(at.news.empty());
  EXPECT_EQ(bird_of(at.sensor.take(at.room.birds()).event, "reference"), nullptr);
}

TEST(ReferenceSensor, ABumpIsNoNewsWhileAHandHoldsTheScope) {
  Follower at;
  at.room.noise_mm = 0.5;
  at.room.noise_deg = 0.1;
  const auto hold = [&] {
    at.room.patient_from_scope = at.room.patient_from_scope * by<Sensor, Sensor>({0, 0.3, 0}, {0.6, 0, 0.2});
  };
  at.follow(100, [&](double) { hold(); });
  at.follow(20, [&](double share) {
    hold();
    at.room.tracker_from_room =
        by<Tracker, Tracker>(share * Eigen::Vector3d(3, 0, 4), share * Eigen::Vector3d(7, 16, -9));
  });
  at.follow(100, [&](double) { hold(); });
  EXPECT_TRUE(at.news.empty()) << static_cast<int>(at.news.front());
}

TEST(ReferenceSensor, OneThatComesOffIsSeenWithin150ms) {
  for (const double mm : {8.0, 15.0, 60.0}) {
    Follower at;
    at.room.noise_mm = 0.5;
    at.room.noise_deg = 0.1;
    at.follow(100);
    const auto fixed = at.room.patient_from_reference;
    at.follow(10, [&](double share) {
      at.room.patient_from_reference =
          fixed * by<Sensor, Sensor>({0, 4 * share, 3 * share}, {0.8 * mm * share, 0, -0.6 * mm * share});
    });
    at.follow(5);
    EXPECT_EQ(at.news, std::vector<News>{News::moved}) << mm;
  }
}

/// As of a blow that moves both: the slip may not pass for part of the bump.
TEST(ReferenceSensor, OneThatSlipsAsTheTransmitterIsBumpedIsSeen) {
  Follower at;
  at.follow(50);
  const auto fixed = at.room.patient_from_reference;
  at.follow(10, [&](double share) {
    at.room.tracker_from_room =
        by<Tracker, Tracker>(share * Eigen::Vector3d(0, 4, 3), share * Eigen::Vector3d(12, 14, -8));
    at.room.patient_from_reference = fixed * by<Sensor, Sensor>({0, 2 * share, 2 * share}, {6 * share, 0, -5 * share});
  });
  at.follow(20);
  EXPECT_EQ(at.news, std::vector{News::moved});
}

TEST(ReferenceSensor, OneThatSlipsWhileItsRecordsAreLostIsSeenHoweverLongTheHole) {
  for (int hole = 1; hole <= 15; ++hole) {
    for (const bool all : {false, true}) {
      Follower at;
      at.follow(50);
      const auto fixed = at.room.patient_from_reference;
      at.follow(hole, [&](double share) {
        (all ? at.room.any_seen : at.room.reference_seen) = false;
        at.room.patient_from_reference = fixed * by<Sensor, Sensor>({0, 8 * share, 0}, {14 * share, 0, 0});
      });
      at.room.any_seen = at.room.reference_seen = true;
      at.follow(30);
      EXPECT_FALSE(at.news.empty()) << 10 * hole << " ms" << (all ? ", all birds" : "");
    }
  }
}

TEST(ReferenceSensor, AHoleInItsRecordsAloneIsNoNews) {
  for (int hole = 1; hole <= 9; ++hole) {
    Follower at;
    at.room.noise_mm = 0.5;
    at.room.noise_deg = 0.1;
    at.follow(100);
    at.room.reference_seen = false;
    at.follow(hole);
    at.room.reference_seen = true;
    at.follow(100);
    EXPECT_TRUE(at.news.empty()) << 10 * hole << " ms";
  }
}

TEST(ReferenceSensor, ATableThatTiltsAndNoiseAreNoNews) {
  Follower at;
  at.room.noise_mm = 0.7;
  at.room.noise_deg = 0.15;
  at.follow(3000);
  const auto level = at.room.room_from_patient;
  at.follow(300, [&](double share) {
    const double eased = share * share * (3 - 2 * share);
    at.room.room_from_patient = level * by<Patient, Patient>({0, 0, 8 * eased}, {0, 0, 0});
  });
  at.follow(200);
  EXPECT_TRUE(at.news.empty());
}

TEST(ReferenceSensor, ATrackerThatScattersMuchIsNotTakenForOneThatComesOff) {
  Follower at;
  at.room.noise_mm = 3;
  at.room.noise_deg = 0.3;
  at.follow(3000);
  EXPECT_TRUE(at.news.empty());
}

TEST(ReferenceSensor, ItsLossIsSeenOnceAndItsReturnToo) {
  Follower at;
  at.follow(50);
  at.room.reference_seen = false;
  at.follow(4);
  EXPECT_NE(bird_of(at.sensor.take(at.room.birds()).event, "scope"), nullptr) << "a few records are bridged";
  at.room.reference_seen = true;
  at.follow(20);
  EXPECT_TRUE(at.news.empty());
  at.room.reference_seen = false;
  at.follow(12);
  EXPECT_EQ(at.news, std::vector<News>{News::lost});
  EXPECT_EQ(bird_of(at.sensor.take(at.room.birds()).event, "scope"), nullptr) << "no pose is relative to nothing";
  at.follow(100);
  at.room.reference_seen = true;
  at.follow(50);
  EXPECT_EQ(at.news, (std::vector<News>{News::lost, News::returned}));
}

TEST(ReferenceSensor, FramesTellOfItsLossWhereNoBirdsComeAnyMore) {
  Follower at;
  at.follow(50);
  wire::VideoFrame frame;
  frame.info.acquired = DeviceTime{(at.room.time_ms + 110) * kMs};
  frame.info.pose.kind = PoseKind::predicted;
  frame.info.pose.tracker_from_sensor = Transform<Tracker, Sensor>();
  (void)at.sensor.take(wire::Doubt{{}, "reference", "sensor saturated"});
  const auto relative = at.sensor.take(frame);
  EXPECT_EQ(relative.news, News::lost);
  const auto& pose = std::get<wire::VideoFrame>(relative.event).info.pose;
  EXPECT_FALSE(pose.tracker_from_sensor);
  EXPECT_EQ(pose.reason, "the reference \"reference\" is not seen: sensor saturated");
}

TEST(ReferenceSensor, TheScatterOfBothBirdsCounts) {
  Follower at;
  at.room.noise_deg = 0.3;  // half a metre off, 2 mm
  at.follow(200);
  wire::VideoFrame frame;
  frame.info.acquired = DeviceTime{(at.room.time_ms - 35) * kMs};
  frame.info.pose.kind = PoseKind::interpolated;
  frame.info.pose.tracker_from_sensor = Transform<Tracker, Sensor>();
  frame.info.pose.position_sigma_mm = 0.1;
  const auto relative = at.sensor.take(frame);
  EXPECT_GT(std::get<wire::VideoFrame>(relative.event).info.pose.position_sigma_mm, 0.3);
}

TEST(ReferenceSensor, PosesStayTheTrackersWhereNoneIsUsed) {
  ReferenceSensor none;
  const Room room;
  const auto same = none.take(room.birds());
  EXPECT_EQ(same.news, News::none);
  EXPECT_EQ(apart(bird_of(same.event, "scope")->tracker_from_sensor.matrix(),
                  room.birds().birds[0].tracker_from_sensor.matrix()),
            0);
  EXPECT_NE(bird_of(same.event, "reference"), nullptr);
}

/// A patient that is registered with a reference, before a running overlay.
class Referenced : public ::testing::Test {
 protected:
  inline static const Transform<Camera, Patient> kCameraFromPatient{Eigen::Matrix3d::Identity(), {-30, -30, 80}};

  void SetUp() override {
    LiveSettings settings = operation_settings(scratch_);
    workflow_ = std::make_unique<LiveWorkflow>(settings);
    // The scope is where it looks from all the while: one that jumps scatters.
    const auto camera_from_sensor = birdseye::testing::straight_scope_record().hand_eye->camera_from_sensor;
    room_.patient_from_scope = kCameraFromPatient.inverse() * camera_from_sensor;
    load(*workflow_);
    connect(*workflow_);
    tell_reference("reference");
    give_record(*workflow_);
    workflow_->primary(HostTime{0});
    for (const Eigen::Vector3d& fiducial : kFiducials) touch(fiducial);
    touch({0, 0, 200}, 1);
    workflow_->go_to(LiveStep::run);
    pass(200);
    ASSERT_TRUE(overlaid()) << reason();
  }
  void tell_reference(const std::string& name) {
    wire::Health health;
    health.state = "ready";
    health.reference = name;
    health.instruments = {{"tracker", "running", "", 0, birdseye::testing::kTracker},
                          {"camera", "running", "", 0, birdseye::testing::kCamera}};
    workflow_->take(health, HostTime{room_.time_ms * kMs}, std::nullopt);
  }
  void touch(const Eigen::Vector3d& place_mm, int samples = 80) {
    const Eigen::Vector3d from_mm = room_.tip_in_patient_mm;
    for (int i = 0; i < 30; ++i) {
      room_.tip_in_patient_mm = from_mm + (place_mm - from_mm) * (i / 29.0);
      measure();
    }
    for (int i = 0; i < samples; ++i) measure();
  }
  void check_at_tumour() {
    touch(kFiducials[0], 5);
    workflow_->primary(HostTime{room_.time_ms * kMs});
    touch(birdseye::testing::kTumour, 5);
    show_frame();
    workflow_->primary(HostTime{room_.time_ms * kMs});
  }
  void measure() {
    room_.time_ms += 10;
    workflow_->take(room_.birds(), HostTime{room_.time_ms * kMs}, ClockGap{});
  }
  /// Poses every 10 ms, and frames every 40 that look at the patient's middle.
  void pass(
      int ms, const std::function<void(double share)>& change = [](double) {}) {
    for (int i = 10; i <= ms; i += 10) {
      change(static_cast<double>(i) / ms);
      measure();
      if (i % 40 == 0) show_frame();
    }
  }
  void show_frame() {
    const Transform<Camera, Sensor> camera_from_sensor =
        workflow_->picture().setup() ? workflow_->picture().setup()->camera_from_sensor() : Transform<Camera, Sensor>();
    room_.patient_from_scope = kCameraFromPatient.inverse() * camera_from_sensor;
    wire::VideoFrame frame;
    frame.width_px = 768;
    frame.height_px = 576;
    frame.rgb = std::make_shared<std::vector<std::uint8_t>>(std::size_t{3} * 768 * 576, 90);
    frame.info.acquired = DeviceTime{(room_.time_ms - 2) * kMs};
    frame.info.pose.kind = PoseKind::exact;
    frame.info.pose.position_sigma_mm = 0.1;
    frame.info.pose.tracker_from_sensor = room_.seen(room_.patient_from_scope, 1);
    workflow_->take(frame, HostTime{room_.time_ms * kMs}, ClockGap{{}, {HostTime{0}, {}}});
    workflow_->draw();
  }
  bool overlaid() { return workflow_->shown_at(HostTime{room_.time_ms * kMs}).overlaid; }
  std::string reason() { return workflow_->shown_at(HostTime{room_.time_ms * kMs}).reason; }
  /// How far the overlay is drawn from where the patient is seen.
  double off_mm() {
    const auto drawn_from = workflow_->picture().camera_from_patient();
    EXPECT_TRUE(drawn_from);
    return drawn_from ? (*drawn_from * Eigen::Vector3d(30, 30, 20) - Eigen::Vector3d(0, 0, 100)).norm() : 1e9;
  }

  const Scratch scratch_;
  std::unique_ptr<LiveWorkflow> workflow_;
  Room room_;
};

TEST_F(Referenced, ABumpedTransmitterChangesNothing) {
  pass(200, [&](double share) {
    room_.tracker_from_room =
        by<Tracker, Tracker>(share * Eigen::Vector3d(3, 0, 4), share * Eigen::Vector3d(7, 16, -9));
    EXPECT_TRUE(overlaid()) << reason();
  });
  pass(400);
  EXPECT_TRUE(overlaid()) << reason();
  EXPECT_LT(off_mm(), 1e-3);
  EXPECT_FALSE(workflow_->view().unconfirmed);
}

TEST_F(Referenced, APatientThatMovesTakesTheOverlayAlong) {
  pass(3000, [&](double share) {
    room_.room_from_patient = kTrackerFromPatient * by<Patient, Patient>({0, 0, 6 * share}, {0, 0, -15 * share});
  });
  pass(400);
  EXPECT_TRUE(overlaid()) << reason();
  EXPECT_LT(off_mm(), 0.01);
}

TEST_F(Referenced, OneThatComesOffTakesTheOverlayAwayWithin150msUntilSomebodyHasLooked) {
  const auto fixed = room_.patient_from_reference;
  pass(150, [&](double share) {
    room_.patient_from_reference = fixed * by<Sensor, Sensor>({0, 8 * share, 6 * share}, {12 * share, 0, -9 * share});
  });
  EXPECT_FALSE(overlaid());
  EXPECT_NE(reason().find("came off or was pushed"), std::string::npos) << reason();
  EXPECT_EQ(workflow_->view().step, LiveStep::check);
  EXPECT_NE(workflow_->view().note(LiveStep::check).line.find("register anew"), std::string::npos);
  EXPECT_TRUE(workflow_->view().unconfirmed);
  const StepNote fiducials = workflow_->view().note(LiveStep::fiducials);
  EXPECT_TRUE(fiducials.done && !fiducials.holds());
  EXPECT_NE(fiducials.doubt.find("came off or was pushed"), std::string::npos) << fiducials.doubt;
  room_.patient_from_reference = fixed;  // somebody has put it back
  pass(2000);
  EXPECT_FALSE(overlaid()) << "whether just there, nobody has said";
  workflow_->primary(HostTime{room_.time_ms * kMs});
  EXPECT_FALSE(overlaid()) << "nor by a press with the pointer away from any landmark";
  check_at_tumour();
  EXPECT_EQ(reason(), "the next picture is awaited");
  pass(1000);
  EXPECT_TRUE(overlaid()) << reason();
  EXPECT_TRUE(workflow_->view().note(LiveStep::fiducials).holds()) << "somebody has looked";
}

TEST_F(Referenced, TouchesFromBeforeItCameOffAreNotMixedWithNewOnes) {
  const auto fixed = room_.patient_from_reference;
  pass(100, [&](double share) {
    room_.patient_from_reference = fixed * by<Sensor, Sensor>({0, 8 * share, 6 * share}, {12 * share, 0, -9 * share});
  });
  pass(200);
  ASSERT_TRUE(workflow_->view().unconfirmed);
  workflow_->go_to(LiveStep::fiducials);
  touch(kFiducials[0]);
  touch({0, 0, 200}, 1);
  EXPECT_EQ(workflow_->view().touches.size(), 1U);
  EXPECT_FALSE(workflow_->picture().setup().has_value());
  for (std::size_t i = 1; i < kFiducials.size(); ++i) touch(kFiducials[i]);
  touch({0, 0, 200}, 1);
  workflow_->go_to(LiveStep::run);
  pass(1000);
  EXPECT_TRUE(overlaid()) << reason();
  EXPECT_LT(off_mm(), 0.01);
}

TEST_F(Referenced, ItsLossTakesTheOverlayAwayWithin150ms) {
  room_.reference_seen = false;
  pass(150);
  EXPECT_FALSE(overlaid());
  EXPECT_NE(reason().find("was not seen for a moment"), std::string::npos) << reason();
  EXPECT_EQ(workflow_->view().step, LiveStep::check);
  workflow_->primary(HostTime{room_.time_ms * kMs});
  pass(200);
  EXPECT_FALSE(overlaid()) << "it is still not seen";
  EXPECT_NE(workflow_->view().note(LiveStep::check).line.find("the pointer is not seen"), std::string::npos)
      << workflow_->view().note(LiveStep::check).line;
  room_.reference_seen = true;
  pass(200);
  EXPECT_FALSE(overlaid()) << "what it did meanwhile nobody knows";
  workflow_->go_to(LiveStep::check);
  check_at_tumour();
  pass(1000);
  EXPECT_TRUE(overlaid()) << reason();
}

TEST_F(Referenced, APauseOfTheVideoDuringWhichItWasSeenAsksNobody) {
  for (int i = 0; i < 1200; ++i) measure();
  pass(200);
  EXPECT_TRUE(overlaid()) << reason();
  room_.time_ms += 12'000;  // and one of everything
  pass(200);
  EXPECT_FALSE(overlaid());
  EXPECT_TRUE(workflow_->view().unconfirmed);
}

TEST_F(Referenced, TheRegistrationHoldsOnlyWithTheSameReference) {
  EXPECT_EQ(workflow_->view().reference, "reference");
  tell_reference("");
  EXPECT_FALSE(overlaid());
  EXPECT_NE(reason().find("found with the reference \"reference\", and none is used now"), std::string::npos)
      << reason();
  EXPECT_EQ(workflow_->view().step, LiveStep::fiducials);
  tell_reference("pointer");
  EXPECT_FALSE(overlaid());
  EXPECT_NE(reason().find("and \"pointer\" is used now"), std::string::npos) << reason();
  tell_reference("reference");
  pass(1000);
  EXPECT_FALSE(overlaid()) << "what it did meanwhile nobody knows";
  workflow_->go_to(LiveStep::check);
  check_at_tumour();
  pass(1000);
  EXPECT_TRUE(overlaid()) << reason();
}

/// A window that is opened again knows of no reference until the appliance tells, once a second.
TEST_F(Referenced, ATouchBeforeItIsHeardOfDropsNoRegistration) {
  Operation kept;
  kept.ct_sha256 = workflow_->view().patient->ct_sha256;
  kept.made_utc = "2026-11-22T10:00:00Z";
  kept.registered = {kTrackerFromPatient, 0.3, kFiducials, {birdseye::testing::kTracker, {}, 0, "reference"}};
  const auto folder = scratch_ / "kept";
  std::filesystem::create_directory(folder);
  ASSERT_TRUE(write_operation(folder, kept, *testing::authors().machine));
  const auto open = [&] {
    LiveSettings settings = operation_settings(scratch_);
    settings.resume = folder;
    workflow_ = std::make_unique<LiveWorkflow>(settings);
    load(*workflow_);
    workflow_->set_link(true, "connected");
    measure();
    give_record(*workflow_);
    workflow_->go_to(LiveStep::fiducials);
  };
  open();
  touch(kFiducials[1]);
  EXPECT_NE(workflow_->view().note(LiveStep::fiducials).line.find("and none is used now"), std::string::npos)
      << workflow_->view().note(LiveStep::fiducials).line;
  touch({0, 0, 200}, 1);
  EXPECT_TRUE(workflow_->view().touches.empty());
  tell_reference("reference");
  EXPECT_TRUE(workflow_->view().note(LiveStep::fiducials).done) << workflow_->view().note(LiveStep::fiducials).line;
  EXPECT_EQ(workflow_->view().fre_mm, 0.3);
  // Where it does not tell, as another server, the patient can be registered anew.
  open();
  pass(2500);
  touch(kFiducials[1]);
  touch({0, 0, 200}, 1);
  EXPECT_EQ(workflow_->view().touches.size(), 1U);
}

TEST_F(Referenced, ARegistrationWithoutAReferenceIsNotUsedWithOne) {
  tell_reference("");
  for (const Eigen::Vector3d& fiducial : kFiducials) touch(fiducial);
  touch({0, 0, 200}, 1);
  workflow_->go_to(LiveStep::run);
  pass(200);
  ASSERT_TRUE(overlaid()) << reason();
  EXPECT_EQ(workflow_->view().reference, "");
  tell_reference("reference");
  pass(200);
  EXPECT_FALSE(overlaid());
  EXPECT_NE(reason().find("found without a reference, and \"reference\" is used now"), std::string::npos) << reason();
}

TEST_F(Referenced, TheOperationThatIsKeptNamesTheReference) {
  Operation kept;
  kept.ct_sha256 = std::string(64, '0');
  kept.made_utc = "2026-11-22T10:00:00Z";
  kept.registered = {kTrackerFromPatient, 0.3, kFiducials, {birdseye::testing::kTracker, {}, 0, "reference"}};
  ASSERT_TRUE(write_operation(scratch_.path(), kept, *testing::authors().machine));
  const auto read = read_operation(scratch_.path());
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->registered->found_with.reference, "reference");
}

}  // namespace
}  // namespace birdseye::host
