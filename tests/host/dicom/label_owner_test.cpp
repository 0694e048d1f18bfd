#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"
#include "tests/support/dicom_segmentation.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::add_item;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::put;
using testing::Scratch;

/// A segmentation read over a CT of the series 2.25.1, with what is set in the files of either.
Result<LabelVolume> labels_of(const testing::Elements& of_ct, const testing::Elements& of_labels) {
  const Scratch scratch;
  testing::write_ct_series(scratch / "ct", {}, 4, of_ct);
  testing::Segmentation seg;
  seg.frames = {{1, {0, 0, 2}, std::vector<int>(15, 1)}};
  testing::write_segmentation(scratch / "seg.dcm", seg, of_labels);
  const auto ct = import_volume(scratch / "ct");
  if (!ct) return ct.error();
  return import_named_labels(scratch / "seg.dcm", *ct);
}

testing::Elements refers_to(const std::vector<std::string>& series) {
  return [series](DcmDataset& dataset) {
    for (const std::string& uid : series)
      put(add_item(dataset, DCM_ReferencedSeriesSequence), DCM_SeriesInstanceUID, uid);
  };
}

TEST(DicomSegOwner, OfAnotherSeriesThanTheCtIsRefused) {
  for (const auto& series : {std::vector<std::string>{}, {"2.25.1"}, {"2.25.7", "2.25.1"}}) {
    const auto labels = labels_of({}, refers_to(series));
    EXPECT_TRUE(labels) << labels.error().what;
  }
  const auto other = labels_of({}, refers_to({"2.25.12"}));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().what, HasSubstr("seg.dcm: is of another series than the CT: it says it is of 2.25.12, and "
                                            "the CT is 2.25.1; give the segmentation of this CT, or"));
  const auto others = labels_of({}, refers_to({"2.25.12", "2.25.13", "2.25.14"}));
  ASSERT_FALSE(others);
  EXPECT_THAT(others.error().what, HasSubstr("it says it is of 2.25.12 and 2 more, and the CT is 2.25.1;"));
}

TEST(DicomSegOwner, ASeriesOfAnotherExaminationCountsToo) {
  const auto labels = labels_of({}, [](DcmDataset& dataset) {
    refers_to({"2.25.12"})(dataset);
    DcmItem& study = add_item(dataset, DCM_StudiesContainingOtherReferencedInstancesSequence);
    put(add_item(study, DCM_ReferencedSeriesSequence), DCM_SeriesInstanceUID, "2.25.1");
  });
  EXPECT_TRUE(labels) << labels.error().what;
}

TEST(DicomSegOwner, WhereTheCtHasNoSeriesOnlyTheRestIsCompared) {
  const auto labels =
      labels_of([](DcmDataset& dataset) { EXPECT_TRUE(dataset.findAndDeleteElement(DCM_SeriesInstanceUID).good()); },
                refers_to({"2.25.12"}));
  EXPECT_TRUE(labels) << labels.error().what;
}

testing::Elements patient(const std::optional<std::string>& id, const std::optional<std::string>& name) {
  return [id, name](DcmDataset& dataset) {
    if (id) put(dataset, DCM_PatientID, *id);
    if (name) put(dataset, DCM_PatientName, *name);
  };
}

TEST(DicomSegOwner, WithoutAnIdOnEachSideNamesTell) {
  for (const auto& [ct_id, id] :
       {std::pair<std::optional<std::string>, std::optional<std::string>>{"A1", ""}, {"", "A1"}, {"", ""}, {{}, {}}}) {
    const auto other = labels_of(patient(ct_id, "Doe^Jane"), patient(id, "Roe^Mary"));
    ASSERT_FALSE(other);
    EXPECT_THAT(other.error().what,
                HasSubstr("seg.dcm: is of patient Roe, Mary, and the CT of patient Doe, Jane; give"));
    for (const char* name : {"DOE^Jane^^", "doe^jane ", "Doe, Jane", "", "^^"}) {
      const auto same = labels_of(patient(ct_id, "Doe^Jane"), patient(id, name));
      ASSERT_TRUE(same) << name << ": " << same.error().what;
      EXPECT_THAT(same->notes, Not(Contains(HasSubstr("patient"))));
    }
  }
}

TEST(DicomSegOwner, AnotherNameWithTheSameIdIsNotedWithoutIt) {
  const auto married = labels_of(patient("A1", "Doe^Jane"), patient("A1", "Roe^Jane"));
  ASSERT_TRUE(married) << married.error().what;
  EXPECT_THAT(married->notes, Contains(HasSubstr("seg.dcm: has the CT's patient ID, and another patient name; see")));
  EXPECT_THAT(married->notes, Not(Contains(HasSubstr("Jane"))));
  const auto same = labels_of(patient("A1", "Doe^Jane"), patient("A1", "DOE^JANE"));
  ASSERT_TRUE(same) << same.error().what;
  EXPECT_THAT(same->notes, Not(Contains(HasSubstr("patient"))));
}

}  // namespace
}  // namespace birdseye::host
