// Whether what judges operations can tell.
#include "hw-sim/operation/operation_laws.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/units.hpp"

namespace birdseye::hw_sim {
namespace {

/// What laws say of a patient without a fault, by hand.
class Laws : public ::testing::Test {
 protected:
  Laws()
      : laws_(
            truth_, faults_, [](std::uint64_t) { return 1'000'000'000; }, 0) {}

  wire::Birds scope(double at_s, const Eigen::Vector3d& off_mm) {
    const auto pose = truth_.tracker_from_sensor(0, at_s);
    wire::Birds birds;
    birds.acquired = DeviceTime{static_cast<std::int64_t>(at_s * 1e9)};
    birds.birds.push_back({"scope", {pose.rotation(), Eigen::Vector3d(pose.translation() + off_mm)}});
    return birds;
  }

  FaultScript faults_;
  OperationTruth truth_{1, 96, 72, Happenings(), false};
  OperationLaws laws_;
};

TEST_F(Laws, APoseThatIsOffByMoreThanItMayBeIsFound) {
  laws_.take(scope(1, {1, 0, 0}), HostTime{1'020'000'000});
  EXPECT_TRUE(laws_.broken().empty());
  laws_.take(scope(2, {20, 0, 0}), HostTime{2'020'000'000});
  ASSERT_EQ(laws_.broken().size(), 1U);
  EXPECT_EQ(laws_.broken().front().law, "pose");
}

TEST_F(Laws, APoseThatIsTurnedByMoreThanItMayBeIsFound) {
  wire::Birds birds = scope(1, {0, 0, 0});
  const Transform<Tracker, Sensor> pose = birds.birds.front().tracker_from_sensor;
  const auto turned = [&](double by_deg) {
    const Eigen::Matrix3d by = Eigen::AngleAxisd(by_deg * kRadPerDeg, Eigen::Vector3d::UnitX()).toRotationMatrix();
    birds.birds.front().tracker_from_sensor = {Eigen::Matrix3d(pose.rotation() * by), pose.translation()};
    return birds;
  };
  laws_.take(turned(0.5), HostTime{1'020'000'000});
  EXPECT_TRUE(laws_.broken().empty());
  laws_.take(turned(3), HostTime{1'020'000'000});
  ASSERT_EQ(laws_.broken().size(), 1U);
  EXPECT_EQ(laws_.broken().front().law, "pose");
}

TEST_F(Laws, AQueueThatHoldsMoreThanItsBoundIsFound) {
  const auto holds = [&](std::size_t values, std::size_t bytes) {
    const QueueFill fill{"poses", values, 256, bytes, 1'000'000};
    laws_.take(std::span(&fill, 1), HostTime{1'000'000'000});
    return laws_.broken().size();
  };
  EXPECT_EQ(holds(128, 1'000'000), 0U);
  EXPECT_EQ(laws_.figures().fullest_queue, 1);
  EXPECT_EQ(holds(257, 1'000'000), 1U);
  EXPECT_EQ(holds(256, 1'000'001), 2U);
  EXPECT_EQ(laws_.broken().back().law, "queues");
  EXPECT_EQ(laws_.broken().back().what, "poses: 1000001 bytes wait, of at most 1000000");
}

TEST_F(Laws, MemoryThatGrowsOnIsFound) {
  constexpr std::size_t kMb = std::size_t{1} << 20;
  laws_.take_memory(100 * kMb, HostTime{60'000'000'000});
  laws_.take_memory(110 * kMb, HostTime{130'000'000'000});
  EXPECT_TRUE(laws_.broken().empty());
  laws_.take_memory(117 * kMb, HostTime{140'000'000'000});
  ASSERT_EQ(laws_.broken().size(), 1U);
  EXPECT_EQ(laws_.broken().front().law, "memory");
}

TEST_F(Laws, WhatTheFirstMatchingHoldsIsNoGrowth) {
  constexpr std::size_t kMb = std::size_t{1} << 20;
  host::OperationView view;
  laws_.take_memory(10 * kMb, HostTime{60'000'000'000});
  view.deforming = true;
  laws_.take(view, 0, HostTime{130'000'000'000});
  laws_.take_memory(30 * kMb, HostTime{159'000'000'000});
  EXPECT_TRUE(laws_.broken().empty());
  view.deforming = false;
  laws_.take(view, 0, HostTime{170'000'000'000});
  view.deforming = true;
  laws_.take(view, 0, HostTime{180'000'000'000});
  laws_.take_memory(47 * kMb, HostTime{190'000'000'000});
  ASSERT_EQ(laws_.broken().size(), 1U) << "the second";
  EXPECT_EQ(laws_.broken().front().law, "memory");
}

/// for_s: empty: for good.
FaultScript frozen_at_10_s(std::optional<double> for_s) {
  FaultScript faults;
  faults.tracker.push_back({FaultKind::frozen_pose, 10, for_s, {}});
  return faults;
}

TEST(OperationLaws, AFaultThatNobodyNamesAndThatDoesNotEndIsFound) {
  const FaultScript faults = frozen_at_10_s(2);
  const OperationTruth truth(1, 96, 72, Happenings(), false);
  OperationLaws laws(
      truth, faults, [](std::uint64_t) { return std::nullopt; }, 0);
  laws.finish(60);
  std::vector<std::string> broken;
  for (const BrokenLaw& law : laws.broken()) broken.push_back(law.law);
  EXPECT_EQ(broken, (std::vector<std::string>{"named", "over", "over"}));
}

/// Of two birds one is there again.
TEST(OperationLaws, ABirdThatDoesNotComeBackIsFound) {
  const FaultScript faults = frozen_at_10_s(2);
  const OperationTruth truth(1, 96, 72, Happenings(), false);
  const auto over = [&](std::size_t birds_again) {
    OperationLaws laws(
        truth, faults, [](std::uint64_t) { return std::nullopt; }, 0);
    wire::Birds birds;
    birds.acquired = DeviceTime{13'000'000'000};
    for (std::size_t bird = 0; bird < birds_again; ++bird)
      birds.birds.push_back({bird == 0 ? "scope" : "pointer", truth.tracker_from_sensor(bird, 13)});
    laws.take(birds, HostTime{13'000'000'000});
    laws.finish(60);
    return std::ranges::count(laws.broken(), "over", &BrokenLaw::law);
  };
  EXPECT_EQ(over(1), 2) << "poses, and frames";
  EXPECT_EQ(over(2), 1) << "frames";
}

TEST(OperationLaws, AFaultThatLastsForGoodIsNamedAndNotOver) {
  const FaultScript faults = frozen_at_10_s({});
  const OperationTruth truth(1, 96, 72, Happenings(), false);
  OperationLaws laws(
      truth, faults, [](std::uint64_t) { return std::nullopt; }, 0);
  laws.finish(60);
  ASSERT_EQ(laws.broken().size(), 1U);
  EXPECT_EQ(laws.broken().front().law, "named");
}

TEST(OperationLaws, AWindowThatForgetsTheRegistrationOrHasAnotherIsFound) {
  const OperationTruth truth(1, 96, 72, Happenings(), false);
  host::OperationView view;
  const auto note = [&view](host::LiveStep step) -> host::StepNote& {
    return view.notes[static_cast<std::size_t>(step)];
  };
  note(host::LiveStep::connect).done = note(host::LiveStep::calibrate).done = true;
  const auto show = [&](const std::optional<double>& fre_mm, bool writing) {
    note(host::LiveStep::fiducials).done = fre_mm.has_value();
    view.fre_mm = fre_mm;
    view.writing = writing;
  };
  const auto broken_after = [&](std::optional<double> takes_up_mm) {
    OperationLaws laws(
        truth, {}, [](std::uint64_t) { return std::nullopt; }, 0);
    for (const auto& [fre_mm, writing] : {std::pair{0.5, true}, {0.5, false}, {0.6, false}, {0.7, true}}) {
      show(fre_mm, writing);
      laws.take_kept(view, 0, false, {0});
    }
    laws.opened(1);
    show({}, false);
    laws.take(view, 1, {0});
    laws.take_kept(view, 0, false, {0});
    show(takes_up_mm, false);
    laws.take(view, 1, {5'000'000'000});
    return laws.broken().size();
  };
  EXPECT_EQ(broken_after({}), 1U);
  EXPECT_EQ(broken_after(0.5), 1U) << "a later one was kept";
  EXPECT_EQ(broken_after(0.6), 0U);
  EXPECT_EQ(broken_after(0.7), 0U) << "it may have been written whole";
}

TEST(OperationLaws, AWindowThatHasWhatWasTakenBackIsFound) {
  const OperationTruth truth(1, 96, 72, Happenings(), false);
  host::OperationView none, registered;
  registered.fre_mm = 0.5;
  registered.notes[static_cast<std::size_t>(host::LiveStep::fiducials)].done = true;
  const auto broken_after = [&](bool written, bool touched) {
    OperationLaws laws(
        truth, {}, [](std::uint64_t) { return std::nullopt; }, 0);
    laws.take_kept(registered, 0, false, {0});
    none.writing = !written;
    laws.take_kept(none, 0, false, {0});
    laws.opened(0);
    host::OperationView has = registered;
    if (touched) has.touches.emplace_back();
    laws.take(has, 0, {5'000'000'000});
    return laws.broken().size();
  };
  EXPECT_EQ(broken_after(true, false), 1U);
  EXPECT_EQ(broken_after(true, true), 0U) << "somebody registered anew";
  EXPECT_EQ(broken_after(false, false), 0U) << "what was there before may still be on the disk";
}

TEST(OperationLaws, AWindowThatTakesUpAnotherDeformationIsFound) {
  const OperationTruth truth(1, 96, 72, Happenings(), false);
  host::DeformedOrgan organ;
  organ.field.size = {2, 2, 2};
  organ.field.displacement_mm.assign(8, Eigen::Vector3f(1, 2, 3));
  organ.made_utc = "2026-11-26T09:30:00Z";
  organ.target = host::MotionError{1, 2};
  organ.target_at_rest_mm = Eigen::Vector3d(30, 35, 20);
  organ.care = "few places";
  const auto broken_with = [&](const auto& change, bool with_care = true) {
    OperationLaws laws(
        truth, {}, [](std::uint64_t) { return std::nullopt; }, 0);
    host::OperationView view, none;
    for (const auto step : {host::LiveStep::connect, host::LiveStep::calibrate})
      view.notes[static_cast<std::size_t>(step)].done = none.notes[static_cast<std::size_t>(step)].done = true;
    view.notes[static_cast<std::size_t>(host::LiveStep::fiducials)].done = true;
    view.fre_mm = 0.5;
    view.deformed_with_care = true;
    view.deformed = std::make_shared<const host::DeformedOrgan>(organ);
    laws.take_kept(view, 0, false, {0});
    laws.opened(1);
    laws.take_kept(none, 0, false, {0});
    host::DeformedOrgan other = organ;
    change(other);
    view.deformed = std::make_shared<const host::DeformedOrgan>(other);
    view.deformed_with_care = with_care;
    laws.take(view, 1, {1'000'000'000});
    return laws.broken().size();
  };
  EXPECT_EQ(broken_with([](host::DeformedOrgan&) {}), 0U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan&) {}, false), 1U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan& other) { other.made_utc = "2026-11-26T09:30:01Z"; }), 1U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan& other) { other.field.displacement_mm.back().x() += 0.1F; }), 1U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan& other) {
              other.field.patient_from_lattice.translate(Eigen::Vector3d(0.1, 0, 0));
            }),
            1U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan& other) { other.target->radius95_mm = 1; }), 1U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan& other) { other.target.reset(); }), 1U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan& other) { other.target_at_rest_mm->x() += 1; }), 1U);
  EXPECT_EQ(broken_with([](host::DeformedOrgan& other) { other.care.clear(); }), 1U);
}

/// With the same FRE.
TEST(OperationLaws, ARegistrationThatHasThePatientElsewhereThanBeforeIsFound) {
  OperationTruth truth(1, 96, 72, Happenings(), false);
  OperationLaws laws(
      truth, {}, [](std::uint64_t) { return 1'000'000'000; }, 0);
  host::ShownPicture shown;
  shown.any = shown.overlaid = true;
  shown.strength = 1;
  const auto broken_by = [&](double fre_mm, double off_mm) {
    host::OperationView view;
    view.fre_mm = fre_mm;
    laws.take_kept(view, 0, false, {0});
    const Transform<Tracker, Patient> on = truth.tracker_from_patient(1);
    host::LivePicture picture;
    picture.set_setup(host::ScopeSetup::of_record(truth.record_of(0))
                          ->registered({on.rotation(), Eigen::Vector3d(on.translation().array() + off_mm)}),
                      {});
    picture.take(wire::VideoFrame(), {HostTime{1'000'000'000}});
    laws.take(shown, picture, HostTime{1'020'000'000});
    return laws.broken().size();
  };
  EXPECT_EQ(broken_by(0.5, 0), 0U);
  EXPECT_EQ(broken_by(0.6, 1), 0U) << "another";
  EXPECT_EQ(broken_by(0.5, 1e-9), 0U);
  EXPECT_EQ(broken_by(0.5, 0.1), 1U);
  EXPECT_EQ(laws.broken().front().law, "kept");
}

}  // namespace
}  // namespace birdseye::hw_sim
