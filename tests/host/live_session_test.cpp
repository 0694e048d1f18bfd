// The workflow of the live window without a window: fed with events as an appliance sends them.
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "host/app/live/live_script.hpp"
#include "host/app/live/live_session.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;

constexpr std::int64_t kMs = 1'000'000;

const std::vector<Eigen::Vector3d> kFiducials{{0, 0, 0}, {60, 5, 0}, {10, 70, 20}, {30, 20, 50}};
const Transform<Tracker, Patient> kTrackerFromPatient(
    Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix(), {300, 20, -40});

LiveSettings settings(const Scratch& scratch) {
  LiveSettings out;
  out.patient.ct = birdseye::testing::small_ct(scratch);
  std::ofstream fiducials(scratch / "fiducials.txt");
  for (const Eigen::Vector3d& f : kFiducials) fiducials << f.transpose() << '\n';
  out.patient.fiducials = scratch / "fiducials.txt";
  out.patient.landmarks = scratch.file("landmarks.csv", "name,x,y,z\ntumour,30,30,20\n");
  out.tip_in_pointer_mm = Eigen::Vector3d(0, 0, 150);
  out.fiducials = kFiducials.size();
  return out;
}

/// Waits for the CT, which another thread reads.
void load(LiveSession& session) {
  for (int i = 0; i < 1000 && session.patient() == nullptr && session.fault().empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    session.tick();
  }
  ASSERT_NE(session.patient(), nullptr) << session.fault();
}

/// The pointer's tip at places of the patient, one after the other.
class Hand {
 public:
  explicit Hand(LiveSession& session) : session_(session) {}
  void rest_at(const Eigen::Vector3d& in_patient_mm, int samples) {
    const Eigen::Vector3d to_mm = kTrackerFromPatient * in_patient_mm;
    for (int i = 0; i < 30; ++i) push(at_mm_ + (to_mm - at_mm_) * (i / 29.0));
    for (int i = 0; i < samples; ++i) push(to_mm);
    at_mm_ = to_mm;
  }

 private:
  void push(const Eigen::Vector3d& tip_mm) {
    wire::Birds birds;
    birds.acquired = DeviceTime{time_ms_ * kMs};
    time_ms_ += 10;
    birds.birds.push_back(
        {"pointer", Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), tip_mm - Eigen::Vector3d(0, 0, 150))});
    session_.take(birds, HostTime{birds.acquired.ns}, std::nullopt);
  }
  LiveSession& session_;
  Eigen::Vector3d at_mm_ = Eigen::Vector3d(0, 0, 900);
  std::int64_t time_ms_ = 1000;
};

void connect_and_calibrate(LiveSession& session) {
  wire::Health health;
  health.state = "ready";
  session.take(health, HostTime{0}, std::nullopt);
  session.set_link(true, "connected");
  EXPECT_EQ(session.step(), LiveStep::calibrate);
  wire::Calibration calibration;
  calibration.in_force = true;
  calibration.record = calibration::record_text(birdseye::testing::example_record(768, 576, {}, {}));
  session.take(calibration, HostTime{0}, std::nullopt);
  EXPECT_TRUE(session.note(LiveStep::calibrate).done);
  session.primary();
  EXPECT_EQ(session.step(), LiveStep::fiducials);
}

TEST(LiveSession, GoesFromTheLinkToARegisteredPatient) {
  const Scratch scratch;
  LiveSession session(settings(scratch));
  load(session);
  connect_and_calibrate(session);
  Hand hand(session);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_FALSE(session.picture().setup().has_value());
    hand.rest_at(kFiducials[i], 80);
    hand.rest_at(kFiducials[i] + Eigen::Vector3d(0, 0, 40), 1);
    EXPECT_EQ(session.touches().size(), i + 1);
  }
  // With three there is a fit, and it is shown; which is which is not yet sure enough to go on.
  ASSERT_TRUE(session.fre_mm().has_value()) << session.registration_fault();
  EXPECT_FALSE(session.note(LiveStep::fiducials).done);
  hand.rest_at(kFiducials[3], 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_EQ(session.step(), LiveStep::views);
  session.go_on();
  session.go_on();
  EXPECT_EQ(session.step(), LiveStep::check);
  EXPECT_LT(*session.fre_mm(), 0.05);
  ASSERT_TRUE(session.picture().setup().has_value());
  const auto& found = session.picture().setup()->tracker_from_patient;
  EXPECT_LT((found.translation() - kTrackerFromPatient.translation()).norm(), 0.1);
  hand.rest_at(Eigen::Vector3d(30, 30, 22), 30);
  const auto reading = session.check();
  ASSERT_TRUE(reading.has_value());
  EXPECT_EQ(reading->nearest, "tumour");
  EXPECT_NEAR(reading->distance_mm, 2, 0.1);
  session.go_on();
  EXPECT_EQ(session.step(), LiveStep::run);
}

TEST(LiveSession, AWrongTouchShowsAndIsTakenBack) {
  const Scratch scratch;
  LiveSession session(settings(scratch));
  load(session);
  connect_and_calibrate(session);
  Hand hand(session);
  for (const Eigen::Vector3d& place : {kFiducials[0], kFiducials[1], Eigen::Vector3d(35, 60, 90)}) {
    hand.rest_at(place, 30);
    session.touch();  // the pedal's way: at once
  }
  EXPECT_EQ(session.touches().size(), 3U);
  EXPECT_TRUE(!session.registration_fault().empty() || *session.fre_mm() > 2);
  session.undo_touch();
  EXPECT_EQ(session.touches().size(), 2U);
  EXPECT_FALSE(session.fre_mm().has_value());
  EXPECT_FALSE(session.picture().setup().has_value());
}

TEST(LiveSession, SaysWhatIsWrongWithThePatientsFiles) {
  const Scratch scratch;
  LiveSettings wrong = settings(scratch);
  wrong.patient.ct = scratch / "nothere";
  LiveSession session(wrong);
  for (int i = 0; i < 1000 && session.fault().empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    session.tick();
  }
  EXPECT_NE(session.fault().find("nothere"), std::string::npos);
  LiveSettings unknown = settings(scratch);
  unknown.transfer = "no such preset";
  EXPECT_NE(LiveSession(unknown).fault().find("no such preset"), std::string::npos);
}

TEST(LiveSession, ALostLinkIsSaidAndNothingOfItStays) {
  LiveSession session{LiveSettings{}};
  wire::Health health;
  health.state = "ready";
  session.take(health, HostTime{0}, std::nullopt);
  session.set_link(true, "connected");
  EXPECT_TRUE(session.note(LiveStep::connect).done);
  session.set_link(false, "127.0.0.1:18944: the appliance has gone");
  EXPECT_FALSE(session.note(LiveStep::connect).done);
  EXPECT_FALSE(session.health().has_value());
  EXPECT_EQ(session.link_words(), "127.0.0.1:18944: the appliance has gone");
}

TEST(LiveScript, IsFollowedLineByLine) {
  const Scratch scratch;
  auto script =
      LiveScript::read(scratch.file("s.txt", "# first\nsleep 0.5\nkey space\n\nwait connect 2 # or not\nend\n"));
  ASSERT_TRUE(script) << script.error().what;
  LiveSession session{LiveSettings{}};
  EXPECT_TRUE(script->next(session, HostTime{0})->key.empty());
  EXPECT_TRUE(script->next(session, HostTime{400 * kMs})->key.empty());
  EXPECT_TRUE(script->next(session, HostTime{600 * kMs})->key.empty());  // the pause is over
  EXPECT_EQ(script->next(session, HostTime{600 * kMs})->key, "space");
  EXPECT_FALSE(script->next(session, HostTime{700 * kMs})->end);
  const auto late = script->next(session, HostTime{2800 * kMs});
  ASSERT_FALSE(late);
  EXPECT_NE(late.error().what.find("s.txt:5: connect was not done within 2 s"), std::string::npos) << late.error().what;
}

TEST(LiveScript, NamesALineThatIsNone) {
  const Scratch scratch;
  for (const char* text : {"wait connect\n", "wait nothing 3\n", "jump 3\n", "key\n", "sleep -1\n"}) {
    const auto script = LiveScript::read(scratch.file("s.txt", std::string("end\n") + text));
    ASSERT_FALSE(script) << text;
    EXPECT_NE(script.error().what.find("s.txt:2: "), std::string::npos) << script.error().what;
  }
  EXPECT_FALSE(LiveScript::read(scratch / "none.txt"));
}

}  // namespace
}  // namespace birdseye::host
