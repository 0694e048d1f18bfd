// What is read of the patient before the operation, and what of it is refused.
#include "host/operation/patient.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "host/volume/import.hpp"
#include "host/volume/segmentation.hpp"
#include "tests/support/drawn_posts.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;
using birdseye::testing::small_ct;

/// A small CT, and the ball in it as label 5.
PatientFiles ball(const Scratch& scratch) {
  PatientFiles files;
  files.ct = small_ct(scratch);
  files.labels = scratch / "labels.nii.gz";
  Volume labels = *import_volume(files.ct);
  for (std::int16_t& value : labels.hu) value = value > 0 ? 5 : 0;
  EXPECT_TRUE(write_labels(files.labels, labels));
  return files;
}

TEST(Patient, LabelsNeedThoseOfTheOrgan) {
  const Scratch scratch;
  PatientFiles files = ball(scratch);
  files.shown = {5};
  const auto unsaid = read_patient(files);
  ASSERT_FALSE(unsaid);
  EXPECT_NE(unsaid.error().what.find("--organ"), std::string::npos) << unsaid.error().what;
  files.organ = {1, 2};
  const auto absent = read_patient(files);
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().what.find("labels.nii.gz"), std::string::npos) << absent.error().what;
  EXPECT_NE(absent.error().what.find("--organ 1,2"), std::string::npos) << absent.error().what;
  files.organ = {1, 5};
  const auto read = read_patient(files);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->organ, (std::vector<int>{1, 5})) << "a liver without a tumour is one all the same";
  EXPECT_TRUE(read->labels.has_value());
  files.organ = {"liver"};  // of labels without names: TotalSegmentator's 5
  const auto named = read_patient(files);
  ASSERT_TRUE(named) << named.error().what;
  EXPECT_EQ(named->organ, (std::vector<int>{5}));
  EXPECT_EQ(named->notes, std::vector<std::string>{"the labels have no names: 'liver' is taken for 5, as "
                                                   "TotalSegmentator 2 counts"})
      << "the window's, which whoever confirms the patient reads";
  files.organ = {"lever"};
  EXPECT_NE(read_patient(files).error().what.find("'lever' is none of TotalSegmentator's"), std::string::npos);
}

TEST(Patient, LabelsThatAreNamedNeedTheirFile) {
  const Scratch scratch;
  PatientFiles files;
  files.ct = small_ct(scratch);
  EXPECT_TRUE(read_patient(files)) << "without labels, all of the CT is the organ";
  for (std::vector<LabelChoice> PatientFiles::*const named :
       {&PatientFiles::shown, &PatientFiles::targets, &PatientFiles::organ}) {
    PatientFiles one = files;
    one.*named = {1};
    const auto refused = read_patient(one);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().what.find("give --labels"), std::string::npos) << refused.error().what;
  }
}

TEST(Patient, PostsAreFiducialsWhereThereAreNoBalls) {
  std::mt19937 rng(7);
  auto head = birdseye::testing::drawn_head({0.7, 0.7, 1}, Eigen::Matrix3d::Identity());
  const auto posts = birdseye::testing::posts_on(head, rng);
  head.finish(30, rng);
  const auto found = find_fiducials(head.ct, {});
  ASSERT_EQ(found.size(), posts.size());
  for (const auto& post : posts) {
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&post](const Eigen::Vector3d& place_mm) {
      return (place_mm - post.centre).norm() < 0.5;
    }));
  }
}

TEST(Patient, MarginsAreAboutTheTargets) {
  const Scratch scratch;
  PatientFiles files = ball(scratch);
  files.organ = {5};
  files.margins_mm = {10, 5};
  const auto about_what = check_labels_named(files);
  ASSERT_FALSE(about_what);
  EXPECT_NE(about_what.error().what.find("--targets"), std::string::npos) << about_what.error().what;
  files.targets = {5};
  const auto read = read_patient(files);
  ASSERT_TRUE(read) << read.error().what;
  ASSERT_TRUE(read->margins.has_value());
  EXPECT_EQ(read->margins->size(), 2U);
  EXPECT_EQ(read->margins->front().mm, 5);
}

}  // namespace
}  // namespace birdseye::host
