#include "host/operation/decision_log.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <utility>

#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

LoggedDecision drawn() {
  LoggedDecision out;
  out.sequence = 7;
  out.age_ms = 81.25;
  out.strength = 1;
  out.shape = 2;
  out.said = "Checked, 1.2 mm at the cyst";
  out.grade = Grade::pass;
  out.pose = PoseKind::interpolated;
  out.pose_sigma_mm = 0.125;
  out.pose_age_ms = -12.5;
  out.expected = ErrorBudget{1, 2, 0.5, 0.25, 0.125, MotionError{1.5, 3}};
  out.camera_from_patient = Transform<Camera, Patient>(
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 2) / 3).toRotationMatrix(), Eigen::Vector3d(1, -2, 100));
  return out;
}

LoggedDecision withheld() {
  LoggedDecision out;
  out.sequence = 8;
  out.age_ms = 90;
  out.shape = 2;
  out.reason = "the tracker scatters, by 9.0 mm";
  return out;
}

TEST(DecisionLog, SaysOfEachFrameWhyAndByWhichFigures) {
  const testing::Scratch scratch;
  {
    auto log = DecisionLog::open(scratch / "out");
    ASSERT_TRUE(log);
    log->add(drawn());
    log->add(withheld());
    ASSERT_TRUE(log->close());
  }
  const auto read = read_decisions(scratch / "out");
  ASSERT_TRUE(read) << read.error().what;
  ASSERT_EQ(read->size(), 2U);
  const LoggedDecision &a = (*read)[0], &b = (*read)[1];
  EXPECT_EQ(a.sequence, 7U);
  EXPECT_EQ(a.age_ms, 81.25);
  EXPECT_EQ(a.strength, 1);
  EXPECT_EQ(a.shape, 2U);
  EXPECT_EQ(a.reason, "");
  EXPECT_EQ(a.said, "Checked; 1.2 mm at the cyst");
  EXPECT_EQ(a.grade, Grade::pass);
  EXPECT_EQ(a.pose, PoseKind::interpolated);
  EXPECT_EQ(a.pose_sigma_mm, 0.125);
  EXPECT_EQ(a.pose_age_ms, -12.5);
  ASSERT_TRUE(a.expected && a.expected->motion && a.camera_from_patient);
  EXPECT_NEAR(a.expected->rms_mm(), drawn().expected->rms_mm(), 1e-3);
  EXPECT_NEAR(a.expected->radius95_mm(), drawn().expected->radius95_mm(), 2e-3);
  EXPECT_EQ(a.expected->hand_eye_mm, 2);
  EXPECT_TRUE(a.camera_from_patient->matrix().isApprox(drawn().camera_from_patient->matrix(), 1e-6));
  EXPECT_EQ(b.reason, "the tracker scatters; by 9.0 mm");
  EXPECT_EQ(b.said, "");
  EXPECT_FALSE(b.grade);
  EXPECT_EQ(b.strength, 0);
  EXPECT_EQ(b.pose, PoseKind::refused);
  EXPECT_FALSE(b.expected) << "what is not known is absent";
  EXPECT_FALSE(b.camera_from_patient);
}

TEST(DecisionLog, AWindowThatGoesOnInAFolderKeepsTheLogsOfThoseBefore) {
  const testing::Scratch scratch;
  for (std::uint64_t n = 1; n <= 3; ++n) {
    auto log = DecisionLog::open(scratch / "out");
    ASSERT_TRUE(log) << log.error().what;
    LoggedDecision decision = withheld();
    decision.sequence = n;
    log->add(decision);
    ASSERT_TRUE(log->close());
  }
  for (const auto& [file, sequence] : {std::pair{"frames-1.csv", 1U}, {"frames-2.csv", 2U}, {"frames.csv", 3U}}) {
    const auto read = read_decisions(scratch / "out" / file);
    ASSERT_TRUE(read) << read.error().what;
    ASSERT_EQ(read->size(), 1U) << file;
    EXPECT_EQ(read->front().sequence, sequence) << file;
  }
  EXPECT_EQ(read_decisions(scratch / "out")->front().sequence, 3U) << "the newest is the folder's";
}

TEST(DecisionLog, ALineThatIsCutShortIsTheLastOrAnError) {
  const testing::Scratch scratch;
  {
    auto log = DecisionLog::open(scratch / "out");
    ASSERT_TRUE(log);
    log->add(drawn());
    log->add(withheld());
  }
  std::ofstream(scratch / "out/frames.csv", std::ios::app) << "9,80.0";
  auto read = read_decisions(scratch / "out");
  ASSERT_TRUE(read) << "the window was killed as it wrote";
  EXPECT_EQ(read->size(), 2U);
  std::ofstream(scratch / "out/frames.csv", std::ios::app) << "\n9,80.0\n";
  read = read_decisions(scratch / "out");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().what.find("line 4"), std::string::npos) << read.error().what;
}

/// What such a number is turned into is undefined.
TEST(DecisionLog, ANumberThatCountsNothingIsAnError) {
  const testing::Scratch scratch;
  {
    auto log = DecisionLog::open(scratch / "out");
    ASSERT_TRUE(log);
    log->add(withheld());
  }
  const std::string text = testing::contents_of(scratch / "out/frames.csv");
  const auto line = text.find('\n') + 1;
  for (const std::string number : {"1e38", "-1", "0.5", "99999999999999999999"}) {
    // A line follows it: the last may be one that is cut short.
    const std::string row = text.substr(text.find(',', line)), other = text.substr(0, line) + number + row + '7' + row;
    const auto read = read_decisions(scratch.file("frames.csv", other));
    ASSERT_FALSE(read) << number;
    EXPECT_NE(read.error().what.find("line 2"), std::string::npos) << read.error().what;
  }
}

TEST(DecisionLog, AnotherTableIsRefused) {
  const testing::Scratch scratch;
  const auto read = read_decisions(scratch.file("frames.csv", "sequence,acquired_ns\n1,2\n"));
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().what.find("live --out"), std::string::npos);
  EXPECT_NE(read_decisions(scratch / "none").error().what.find("live --out"), std::string::npos);
  ASSERT_EQ(::mkfifo((scratch / "pipe").c_str(), 0600), 0);
  EXPECT_NE(read_decisions(scratch / "pipe").error().what.find("is no file but a pipe"), std::string::npos);
  EXPECT_FALSE(read_decisions(scratch.file("long.csv", std::string(1U << 20U, 'x'))));
}

TEST(DecisionLog, SaysWhetherOverlaysWereOfAnotherShapeOrThereWereNone) {
  EXPECT_EQ(why_not_judged({}), "no frame bore an overlay");
  LoggedErrors before;
  before.mm = {7, 8, 9};
  EXPECT_NE(why_not_judged({{1, before}}).find("3 frames bore one before"), std::string::npos);
}

TEST(DecisionLog, NamesAFileThatCannotBeReadToItsEnd) {
  const auto read = read_decisions("/proc/self/mem");  // it opens, and a read gives an error
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().what.find("/proc/self/mem: cannot be read to its end"), 0U) << read.error().what;
}

}  // namespace
}  // namespace birdseye::host
