#include "host/files/registration_file.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <string>

#include "host/files/text_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;

RegistrationFile example() {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()));
  pose.translation() << 12.25, -88.0, 301.5;
  return {Transform<Patient, Tracker>::from_matrix(pose.matrix()), std::string(64, 'a'), "2026-01-02T03:04:05Z", 0.43};
}

TEST(RegistrationFile, IsReadBackToTheBitAndIsAMatrixToOtherPrograms) {
  const Scratch scratch;
  const std::string path = scratch.file("pose.txt", registration_text(example()));
  const auto read = read_registration(path);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->patient_from_tracker.matrix(), example().patient_from_tracker.matrix());
  EXPECT_EQ(read->ct_sha256, example().ct_sha256);
  EXPECT_EQ(read->made_utc, example().made_utc);
  EXPECT_EQ(read->fre_mm, example().fre_mm);
  const auto matrix = read_pose(path);
  ASSERT_TRUE(matrix) << matrix.error().what;
  EXPECT_EQ(*matrix, example().patient_from_tracker.matrix());
}

TEST(RegistrationFile, APlainMatrixSaysNothingOfItself) {
  const Scratch scratch;
  const auto read = read_registration(scratch.file("pose.txt", "1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n"));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->ct_sha256, "");
  EXPECT_EQ(read->made_utc, "");
  EXPECT_FALSE(read->fre_mm);
  EXPECT_TRUE(check_ct(*read, std::string(64, 'b')));
}

TEST(RegistrationFile, APlainMatrixThatIsTheInverseByItsNameIsRefused) {
  const Scratch scratch;
  const std::string matrix = "1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n";
  const auto inverse = read_registration(scratch.file("tracker_from_patient.txt", matrix));
  ASSERT_FALSE(inverse);
  EXPECT_NE(inverse.error().what.find("by its name it is the inverse"), std::string::npos) << inverse.error().what;
  EXPECT_TRUE(read_registration(scratch.file("patient_from_tracker.txt", matrix)));
}

TEST(RegistrationFile, NotOneCharacterMayBeChanged) {
  const Scratch scratch;
  const std::string text = registration_text(example());
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string changed = text;
    changed[i] = changed[i] == '1' ? '2' : '1';
    const auto read = read_registration(scratch.file("pose.txt", changed));
    ASSERT_FALSE(read) << "character " << i << " of\n" << text;
    EXPECT_NE(read.error().what.find("pose.txt"), std::string::npos) << read.error().what;
  }
}

TEST(RegistrationFile, ACutOneIsRefusedWhereverItWasCut) {
  const Scratch scratch;
  const std::string text = registration_text(example());
  for (std::size_t length = 0; length < text.size(); ++length)
    EXPECT_FALSE(read_registration(scratch.file("pose.txt", text.substr(0, length)))) << "cut after " << length;
}

TEST(RegistrationFile, AnErrorThatNoMeasurementGivesIsRefused) {
  const Scratch scratch;
  RegistrationFile registration = example();
  for (const double fre_mm : {-5.0, 1e30}) {
    registration.fre_mm = fre_mm;
    const auto read = read_registration(scratch.file("pose.txt", registration_text(registration)));
    ASSERT_FALSE(read) << fre_mm;
    EXPECT_NE(read.error().what.find("pose.txt: its fre_mm is"), std::string::npos) << read.error().what;
  }
  registration.fre_mm = 0;
  EXPECT_TRUE(read_registration(scratch.file("pose.txt", registration_text(registration))));
}

TEST(RegistrationFile, OfAnotherCtIsRefusedWithTheRemedy) {
  EXPECT_TRUE(check_ct(example(), std::string(64, 'a')));
  const auto other = check_ct(example(), std::string(64, 'b'));
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("another CT"), std::string::npos);
  EXPECT_NE(other.error().what.find("--spacing"), std::string::npos);
}

TEST(PoseText, OfWhatIsFurtherThanAnyRoomIsRefused) {
  const testing::Scratch scratch;
  const auto far = read_pose(scratch.file("far.txt", "1 0 0 0\n0 1 0 -1e308\n0 0 1 0\n0 0 0 1\n"));
  ASSERT_FALSE(far);
  EXPECT_NE(far.error().what.find("give the translation in mm"), std::string::npos) << far.error().what;
}

}  // namespace
}  // namespace birdseye::host
