#include "host/dicom/patient_identity.hpp"

#include <gtest/gtest.h>

#include "host/volume/import.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::put;
using testing::Scratch;
using testing::write_ct_series;

TEST(PatientIdentity, WritesNamesAsPeopleDo) {
  // The examples of DICOM PS3.5, 6.2.1.1, and of its annexes H and I.
  EXPECT_EQ(person_name("Adams^John Robert Quincy^^Rev.^B.A. M.Div."), "Adams, Rev. John Robert Quincy B.A. M.Div.");
  EXPECT_EQ(person_name("Morrison-Jones^Susan^^^Ph.D., Chief Executive Officer"),
            "Morrison-Jones, Susan Ph.D., Chief Executive Officer");
  EXPECT_EQ(person_name("Yamada^Tarou=山田^太郎=やまだ^たろう"), "Yamada, Tarou");
  EXPECT_EQ(person_name("Doe"), "Doe");
  EXPECT_EQ(person_name("^Jane"), "Jane");
  EXPECT_EQ(person_name(""), "");
  EXPECT_EQ(person_name("^^^^"), "");
}

TEST(PatientIdentity, DatesThatAreNoneAreNotMadeUp) {
  EXPECT_EQ(dashed_date("20261124"), "2026-11-24");
  EXPECT_EQ(dashed_date("20261124133000.5"), "2026-11-24") << "a date with its time";
  for (const char* none : {"", "2026", "2026-11-24", "unknown!"}) EXPECT_EQ(dashed_date(none), "") << none;
}

TEST(PatientIdentity, ComesWithTheCt) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4, [](DcmDataset& dataset) {
    put(dataset, DCM_SpecificCharacterSet, "ISO_IR 100");
    put(dataset, DCM_PatientName, "M\xfcller^Eva");
    put(dataset, DCM_PatientID, "00123");
    put(dataset, DCM_PatientBirthDate, "19610203");
    put(dataset, DCM_StudyDate, "20210501");
  });
  const auto ct = import_with_notes(VolumeSource(scratch / "ct"));
  ASSERT_TRUE(ct) << ct.error().what;
  EXPECT_EQ(ct->patient, (PatientIdentity{"Müller, Eva", "00123", "1961-02-03", "2021-05-03"}));
  EXPECT_TRUE(ct->patient.known());
}

TEST(PatientIdentity, ThatNoFileTellsIsEmpty) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4);
  const auto ct = import_with_notes(VolumeSource(scratch / "ct"));
  ASSERT_TRUE(ct) << ct.error().what;
  EXPECT_FALSE(ct->patient.known());
}

TEST(PatientIdentity, SlicesOfTwoPatientsAreNoCt) {
  const Scratch scratch;
  int n = 0;
  write_ct_series(scratch / "ct", {}, 4, [&n](DcmDataset& dataset) {
    put(dataset, DCM_PatientName, "Doe^Jane");
    put(dataset, DCM_PatientID, ++n == 3 ? "B" : "A");
  });
  const auto ct = import_volume(VolumeSource(scratch / "ct"));
  ASSERT_FALSE(ct);
  EXPECT_NE(ct.error().what.find("two patients"), std::string::npos) << ct.error().what;
  EXPECT_NE(ct.error().what.find("ID A"), std::string::npos) << ct.error().what;
}

}  // namespace
}  // namespace birdseye::host
