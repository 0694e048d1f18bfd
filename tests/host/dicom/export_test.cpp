#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <random>
#include <tuple>

#include "host/dicom/phase_words.hpp"
#include "host/volume/import.hpp"
#include "host/volume/series_list.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::CtSlice;
using testing::put;
using testing::Scratch;
using testing::write_ct_series;
using testing::write_ct_slice;

/// That the folder's CT is one of `slices` slices as write_ct_series writes them from first_hu on.
void expect_ct(const VolumeSource& source, int slices, int first_hu) {
  const auto ct = import_volume(source);
  ASSERT_TRUE(ct) << ct.error().what;
  EXPECT_EQ(ct->size, (std::array<int, 3>{testing::kSliceColumns, testing::kSliceRows, slices}));
  EXPECT_TRUE(ct->spacing_mm.isApprox(Eigen::Vector3d(0.5, 0.75, 2))) << ct->spacing_mm.transpose();
  for (int k = 0; k < slices; ++k) EXPECT_EQ(ct->at(3, 2, k), first_hu + 100 * k + 11) << k;
}

void expect_error(const VolumeSource& source, const std::string& why) {
  const auto ct = import_volume(source);
  ASSERT_FALSE(ct) << "read, where it should say: " << why;
  EXPECT_NE(ct.error().what.find(why), std::string::npos) << ct.error().what;
  EXPECT_EQ(ct.error().what.find('\n'), std::string::npos) << ct.error().what;
}

VolumeSource one_of(const fs::path& path, const std::string& series) {
  VolumeSource source(path);
  source.series = series;
  return source;
}

const SeriesInfo* find(const SeriesList& list, const std::string& id) {
  for (const SeriesInfo& one : list.series) {
    if (one.id == id) return &one;
  }
  return nullptr;
}

TEST(DicomExport, DirectoriesOfAnyNameAndFilesOfNoImageArePassedOver) {
  const Scratch scratch;
  const fs::path folder = scratch / "ct";
  write_ct_series(folder, {}, 4);
  testing::write_directory_file(folder / "INDEX001");
  expect_ct(folder, 4, 0);
  testing::write_no_image(folder / "sr.dcm", UID_BasicTextSRStorage, "SR", 20);
  testing::write_no_image(folder / "ps", UID_GrayscaleSoftcopyPresentationStateStorage, "PR", 21);
  testing::write_no_image(folder / "report", UID_EncapsulatedPDFStorage, "DOC", 22);
  testing::write_no_image(folder / "ko", UID_KeyObjectSelectionDocumentStorage, "KO", 23);
  testing::write_no_image(folder / "dose", UID_XRayRadiationDoseSRStorage, "SR", 24);
  expect_ct(folder, 4, 0);
  const auto told = import_with_notes(folder);
  ASSERT_TRUE(told) << told.error().what;
  std::string notes;
  for (const std::string& note : told->notes) notes += note + "\n";
  for (const char* what : {"BasicTextSR", "GrayscaleSoftcopyPresentationState", "EncapsulatedPDF"})
    EXPECT_NE(notes.find(what), std::string::npos) << notes;
  // A directory file stands for its folder, by its name: what it holds must not open a folder to its decoder.
  testing::write_directory_file(folder / "DICOMDIR");
  expect_ct(folder / "DICOMDIR", 4, 0);
  expect_error(folder / "INDEX001", "not named DICOMDIR; give the folder");
}

TEST(DicomExport, HoldsNothingButADirectoryOrReports) {
  const Scratch scratch;
  testing::write_directory_file(scratch / "a" / "INDEX");
  expect_error(scratch / "a", "holds no DICOM file");
  testing::write_no_image(scratch / "b" / "sr", UID_BasicTextSRStorage, "SR", 20);
  expect_error(scratch / "b", "no image (BasicTextSR");
}

TEST(DicomExport, ListsTheSeriesOfATree) {
  const Scratch scratch;
  CtSlice arterial{"2.25.3", 3, 1, 1000, {0, 0, 0}, "Leber ART 1.0"};
  CtSlice portal{"2.25.4", 4, 1, 2000, {0, 0, 0}, "Leber pv 70s"};
  const auto agent = [](DcmDataset& dataset) { put(dataset, DCM_ContrastBolusAgent, "Iomeron"); };
  write_ct_series(scratch / "DICOM/A/B", arterial, 4, agent);
  write_ct_series(scratch / "DICOM/A/C", portal, 5, agent);
  write_ct_slice(scratch / "DICOM/scout", {"2.25.1", 1, 1, 1000, {0, 0, 0}, "Topogram"},
                 [](DcmDataset& dataset) { put(dataset, DCM_ImageType, "ORIGINAL\\PRIMARY\\LOCALIZER"); });
  testing::write_no_image(scratch / "DICOM/sr", UID_BasicTextSRStorage, "SR", 20);
  testing::write_directory_file(scratch / "DICOMDIR");
  fs::create_directories(scratch / "VIEWER");
  std::ofstream(scratch / "VIEWER/player.bin") << "no DICOM at all";
  const auto list = list_series(VolumeSource(scratch.path()));
  ASSERT_TRUE(list) << list.error().what;
  ASSERT_EQ(list->series.size(), 4U);
  EXPECT_EQ(list->unreadable.size(), 1U);
  EXPECT_EQ(find(*list, "1")->problem, "a localizer");
  EXPECT_EQ(find(*list, "3")->phase, "arterial");
  EXPECT_EQ(find(*list, "4")->phase, "portal venous");
  EXPECT_EQ(find(*list, "4")->agent, "Iomeron");
  EXPECT_EQ(find(*list, "4")->size, (std::array<int, 3>{4, 3, 5}));
  EXPECT_EQ(find(*list, "4")->date, "20210503");
  EXPECT_NE(find(*list, "20")->problem.find("no image"), std::string::npos);
  expect_error(scratch.path(), "holds 2 series (3 'Leber ART 1.0', 4 'Leber pv 70s'); name one with --series");
  for (const char* name : {"3", "2.25.3", "arterial", "leber art 1.0", "ART"})
    expect_ct(one_of(scratch.path(), name), 4, 0);
  for (const char* name : {"4", "2.25.4", "portal venous", "venous", "70s"})
    expect_ct(one_of(scratch.path(), name), 5, 1000);
  expect_error(one_of(scratch.path(), "Leber"), "fits 2");
  expect_error(one_of(scratch.path(), "delayed"), "there is no such series");
  expect_error(one_of(scratch.path(), "20"), "no image");
}

TEST(DicomExport, ACopyOfAWholeSeriesInAnotherFolderIsTheSameSeries) {
  const Scratch scratch;
  write_ct_series(scratch / "cd/DICOM", {}, 4);
  fs::copy(scratch / "cd/DICOM", scratch / "cd/DICOM (copy)");
  expect_ct(scratch / "cd", 4, 0);
}

TEST(DicomExport, ACopyThatIsStoredOtherwiseIsACopy) {
  const Scratch scratch;
  write_ct_series(scratch / "cd/ct", {}, 4);
  write_ct_series(
      scratch / "cd/packed", {}, 4, [](DcmDataset& d) { put(d, DCM_SeriesDescription, "packed"); }, EXS_RLELossless);
  expect_ct(scratch / "cd", 4, 0);
}

/// One that took the place of a slice would show another anatomy there.
TEST(DicomExport, AnotherSliceOfTheSameNameInAnotherFolderIsNoCopy) {
  const Scratch scratch;
  for (const auto& [name, first, z_mm] : {std::tuple{"pixels", 1500, 2.0}, std::tuple{"place", 1100, 8.0}}) {
    const fs::path folder = scratch / name;
    write_ct_series(folder / "ct", {}, 4);
    write_ct_slice(folder / "other/2.dcm", {"2.25.1", 1, 2, first, {0, 0, z_mm}, "abdomen"});
    const auto ct = import_volume(folder);
    ASSERT_FALSE(ct) << name;
    for (const std::string& words :
         {(folder / "ct/2.dcm").string(), (folder / "other/2.dcm").string(),
          std::string("has the SOP Instance UID (0008,0018) of "), std::string("remove the one that does not belong")})
      EXPECT_NE(ct.error().what.find(words), std::string::npos) << ct.error().what;
  }
}

TEST(DicomExport, ACopyOfASliceInItsFolderIsTakenOnceAndSaid) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4);
  fs::copy(scratch / "ct/2.dcm", scratch / "ct/2 (1).dcm");
  expect_ct(scratch / "ct", 4, 0);
  const auto told = import_with_notes(scratch / "ct");
  ASSERT_TRUE(told) << told.error().what;
  ASSERT_EQ(told->notes.size(), 1U);
  EXPECT_EQ(told->notes[0].substr(0, 32), "passed over 1 copy of slices: 2.") << told->notes[0];
  // Of the same name for the world, with other pixels: which one is right, nobody knows.
  write_ct_slice(scratch / "ct/other.dcm", {"2.25.1", 1, 2, 1500, {0, 0, 2}, "abdomen"});
  expect_error(scratch / "ct", "same place");
}

TEST(DicomExport, ASingleSliceBesideASeriesIsPassedOverAndSaid) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4);
  write_ct_slice(scratch / "plan/1.dcm", {"2.25.7", 7, 1, 3000, {0, 0, 0}, "plan"});
  expect_ct(scratch.path(), 4, 0);
  const auto told = import_with_notes(scratch.path());
  ASSERT_TRUE(told) << told.error().what;
  std::string notes;
  for (const std::string& note : told->notes) notes += note + "\n";
  EXPECT_NE(notes.find("passed over series 7 'plan': one slice"), std::string::npos) << notes;
  // By itself, or by its number, it is what is meant.
  expect_ct(scratch / "plan", 1, 2000);
  expect_ct(one_of(scratch.path(), "7"), 1, 2000);
}

TEST(DicomExport, ANumberThatTwoStudiesHaveNamesNone) {
  const Scratch scratch;
  write_ct_series(scratch / "a", {"2.25.1", 3, 1, 1000, {0, 0, 0}, "first"}, 4);
  write_ct_series(scratch / "b", {"2.25.2", 3, 1, 2000, {0, 0, 0}, "second"}, 5);
  expect_error(one_of(scratch.path(), "3"), "--series 3 fits 2 (3a 'first', 3b 'second'); name one by its number");
  expect_ct(one_of(scratch.path(), "3a"), 4, 0);
  expect_ct(one_of(scratch.path(), "3b"), 5, 1000);
}

TEST(DicomExport, SeriesWithoutIdentifiersAreToldApartByTheirFolders) {
  const Scratch scratch;
  const auto anonymous = [](DcmDataset& dataset) {
    for (const DcmTagKey& tag : {DCM_SeriesInstanceUID, DCM_StudyInstanceUID, DCM_SeriesNumber}) put(dataset, tag, "");
  };
  write_ct_series(scratch / "a", {}, 4, anonymous);
  write_ct_series(scratch / "b", {"2.25.2", 2, 1, 2000, {0, 0, 0}, "other"}, 5, anonymous);
  expect_ct(scratch / "a", 4, 0);
  expect_error(scratch.path(), "holds 2");
  expect_ct(one_of(scratch.path(), "other"), 5, 1000);
}

TEST(DicomExport, AFileThatCannotBeReadBesideSlicesIsNamed) {
  const Scratch scratch;
  write_ct_series(scratch / "a", {}, 4);
  write_ct_series(scratch / "b", {"2.25.2", 2, 1, 2000, {0, 0, 0}, "other"}, 4);
  fs::resize_file(scratch / "a/3.dcm", 200);
  expect_error(one_of(scratch.path(), "1"), "3.dcm");
  expect_ct(one_of(scratch.path(), "2"), 4, 1000);
}

/// Two phases in one series, their slices at the same places, told apart by one element.
void expect_two_phases(const DcmTagKey& tag, const std::string& first, const std::string& second,
                       const std::string& part) {
  const Scratch scratch;
  CtSlice slice;
  write_ct_series(scratch / "ct", slice, 4, [&](DcmDataset& dataset) { put(dataset, tag, first); });
  slice.instance = 11;
  slice.first = 3000;
  write_ct_series(scratch / "ct", slice, 4, [&](DcmDataset& dataset) { put(dataset, tag, second); });
  const auto list = list_series(VolumeSource(scratch / "ct"));
  ASSERT_TRUE(list) << list.error().what;
  ASSERT_EQ(list->series.size(), 2U) << list->series[0].problem;
  EXPECT_EQ(list->series[1].part, part);
  expect_error(scratch / "ct", "holds 2 volumes");
  expect_ct(one_of(scratch / "ct", "1.1"), 4, 0);
  expect_ct(one_of(scratch / "ct", "1.2"), 4, 2000);
  expect_ct(one_of(scratch / "ct", part), 4, 2000);
}

TEST(DicomPhases, OfOneSeriesAreToldApart) {
  expect_two_phases(DCM_AcquisitionNumber, "2", "10", "acquisition 10");
  expect_two_phases(DCM_TriggerTime, "350", "1200", "trigger time 1200 ms");
  expect_two_phases(DCM_TemporalPositionIdentifier, "1", "2", "temporal position 2");
  expect_two_phases(DCM_AcquisitionTime, "101500", "101600", "acquisition time 101600");
}

TEST(DicomPhases, AreChosenByTheNameThatOneOfThemHas) {
  const Scratch scratch;
  CtSlice slice;
  slice.description = "Abdomen nativ";
  write_ct_series(scratch / "ct", slice, 4);
  slice.instance = 11;
  slice.first = 3000;
  slice.description = "Abdomen portalvenös";
  write_ct_series(scratch / "ct", slice, 4, [](DcmDataset& d) { put(d, DCM_SpecificCharacterSet, "ISO_IR 192"); });
  expect_ct(one_of(scratch / "ct", "native"), 4, 0);
  expect_ct(one_of(scratch / "ct", "portal venous"), 4, 2000);
}

TEST(DicomPhases, AreToldApartByTheNumbersOfTheirImagesWhereNothingElseTells) {
  const Scratch scratch;
  CtSlice slice;
  write_ct_series(scratch / "ct", slice, 4);
  slice.instance = 11;
  slice.first = 3000;
  write_ct_series(scratch / "ct", slice, 4);
  expect_ct(one_of(scratch / "ct", "1.2"), 4, 2000);
}

TEST(DicomPhases, TwoWithTwoKernelsEachAreFourVolumes) {
  const Scratch scratch;
  CtSlice slice;
  for (const char* acquisition : {"1", "2"}) {
    for (const char* kernel : {"B30f", "B70f"}) {
      write_ct_series(scratch / "ct", slice, 4, [&](DcmDataset& dataset) {
        put(dataset, DCM_AcquisitionNumber, acquisition);
        put(dataset, DCM_ConvolutionKernel, kernel);
      });
      slice.instance += 10;
      slice.first += 1000;
    }
  }
  for (int i = 0; i < 4; ++i) expect_ct(one_of(scratch / "ct", fmt::format("1.{}", i + 1)), 4, 1000 * i);
}

TEST(DicomPhases, ABolusThatIsWatchedIsNoVolumeAndPassedOver) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4);
  CtSlice watched{"2.25.8", 8, 1, 500, {0, 0, 4}, "Monitoring"};
  for (; watched.instance <= 10; ++watched.instance) {
    write_ct_slice(scratch / fmt::format("m/{}.dcm", watched.instance), watched,
                   [&](DcmDataset& dataset) { put(dataset, DCM_AcquisitionNumber, std::to_string(watched.instance)); });
  }
  expect_ct(scratch.path(), 4, 0);
  expect_error(one_of(scratch.path(), "8"), "same place");
}

TEST(DicomPhases, OneSliceTwiceStaysAnError) {
  const Scratch scratch;
  CtSlice slice;
  write_ct_series(scratch / "ct", slice, 4);
  slice.instance = 9;
  slice.place_mm.z() = 4;
  write_ct_slice(scratch / "ct/again.dcm", slice);
  expect_error(scratch / "ct", "same place");
}

TEST(DicomPhases, SlicesThatAreMissingBetweenTwoAcquisitionsStayAnError) {
  const Scratch scratch;
  CtSlice slice;
  write_ct_series(scratch / "ct", slice, 4, [](DcmDataset& d) { put(d, DCM_AcquisitionNumber, "1"); });
  slice.instance = 5;
  slice.place_mm.z() = 10;  // 8 is not there
  write_ct_series(scratch / "ct", slice, 4, [](DcmDataset& d) { put(d, DCM_AcquisitionNumber, "2"); });
  expect_error(scratch / "ct", "missing or unevenly spaced");
}

TEST(DicomPhases, AreNamedInWords) {
  for (const auto& [text, phase] :
       std::vector<std::pair<const char*, const char*>>{{"Abd ART 1.0 B30f", "arterial"},
                                                        {"late arterial phase", "arterial"},
                                                        {"Leber_portalvenoes_3mm", "portal venous"},
                                                        {"PORTAL_VENOUS", "portal venous"},
                                                        {"AX PV 2.5", "portal venous"},
                                                        {"DELAYED 5 MIN", "delayed"},
                                                        {"Spätphase", "delayed"},
                                                        {"W/O CONTRAST", "native"},
                                                        {"PRE_CONTRAST", "native"},
                                                        {"Nativ 5.0", "native"},
                                                        {"ABD WITH CONTRAST", ""},
                                                        {"arterial + venous split bolus", ""},
                                                        {"Part of a smart cart", ""},
                                                        {"", ""}}) {
    EXPECT_EQ(phase_named_in(text), phase) << text;
  }
}

TEST(DicomSyntax, EachGivesTheSameVolume) {
  for (const E_TransferSyntax syntax :
       {EXS_LittleEndianImplicit, EXS_BigEndianExplicit, EXS_DeflatedLittleEndianExplicit}) {
    const Scratch scratch;
    write_ct_series(scratch / "ct", {}, 4, {}, syntax);
    expect_ct(scratch / "ct", 4, 0);
  }
}

TEST(DicomSyntax, RunLengthsByDcmtksOwnProgramGiveTheSameVolume) {
  if (std::system("command -v dcmcrle > /dev/null") != 0) GTEST_SKIP() << "no dcmcrle: install dcmtk";
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4);
  fs::create_directory(scratch / "rle");
  for (int i = 1; i <= 4; ++i) {
    const std::string command = fmt::format("dcmcrle {0}/ct/{1}.dcm {0}/rle/{1}.dcm", scratch.path().string(), i);
    ASSERT_EQ(std::system(command.c_str()), 0);
  }
  expect_ct(scratch / "rle", 4, 0);
  fs::resize_file(scratch / "rle/3.dcm", fs::file_size(scratch / "rle/3.dcm") - 12);
  expect_error(scratch / "rle", "3.dcm");
}

TEST(DicomSyntax, ThatIsNotReadIsNamed) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4, {}, EXS_RLELossless);
  for (const auto& [uid, why] : std::vector<std::pair<std::string, const char*>>{
           {"1.2.840.10008.1.2.9", "is compressed in the syntax 1.2.840.10008.1.2.9, which is not read"},
           {"1.2.840.10008.1.2.6", "is compressed in the syntax 1.2.840.10008.1.2.6"}}) {
    for (int i = 1; i <= 4; ++i) {
      const std::string path = scratch / "ct" / fmt::format("{}.dcm", i);
      std::string bytes = testing::contents_of(path);
      const std::size_t at = bytes.find("1.2.840.10008.1.2.5");
      ASSERT_NE(at, std::string::npos);
      std::ofstream(path + ".other", std::ios::binary) << bytes.replace(at, uid.size(), uid);
    }
    fs::create_directory(scratch / uid);
    for (int i = 1; i <= 4; ++i)
      fs::rename(scratch / "ct" / fmt::format("{}.dcm.other", i), scratch / uid / fmt::format("{}.dcm", i));
    expect_error(scratch / uid, why);
  }
}

TEST(DicomHostile, ClaimsOfSizeAreRefused) {
  const Scratch scratch;
  write_ct_series(scratch / "rows", {}, 2, [](DcmDataset& d) { put(d, DCM_Rows, 65535), put(d, DCM_Columns, 65535); });
  expect_error(scratch / "rows", "which no CT has");
  write_ct_series(scratch / "large", {}, 2, [](DcmDataset& d) { put(d, DCM_Rows, 8000), put(d, DCM_Columns, 8000); });
  expect_error(scratch / "large", "is cut short");
  write_ct_series(scratch / "frames", {}, 2, [](DcmDataset& d) { put(d, DCM_NumberOfFrames, "2147483647"); });
  expect_error(scratch / "frames", "number of frames");
  write_ct_series(scratch / "some", {}, 2, [](DcmDataset& d) { put(d, DCM_NumberOfFrames, "90000"); });
  expect_error(scratch / "some", "several frames without their places");
  write_ct_series(scratch / "bits", {}, 2, [](DcmDataset& d) { put(d, DCM_BitsStored, 99), put(d, DCM_HighBit, 200); });
  expect_error(scratch / "bits", "cannot be decoded");
}

/// A file with these bytes after its meta header, as explicit little-endian elements.
void write_elements(const fs::path& path, const std::string& elements) {
  write_ct_slice(path, {});
  std::string bytes = testing::contents_of(path);
  const std::size_t first = bytes.find(std::string("\x08\0\x08\0", 4), 132);  // Image Type, the first of write_ct_slice
  ASSERT_NE(first, std::string::npos);
  std::ofstream(path, std::ios::binary) << bytes.substr(0, first) << elements;
}

TEST(DicomHostile, WhatIsNestedWithoutEndOrClaimsMoreThanThereIsIsNamed) {
  const Scratch scratch;
  // A private sequence in an item of a private sequence, and so on; none of them ends.
  const std::string sequence("\x09\0\x10\x10SQ\0\0\xFF\xFF\xFF\xFF\xFE\xFF\0\xE0\xFF\xFF\xFF\xFF", 20);
  std::string nested;
  for (int i = 0; i < 300'000; ++i) nested += sequence;
  write_elements(scratch / "nested/1.dcm", nested);
  expect_error(scratch / "nested", "1.dcm");
  write_elements(scratch / "long/1.dcm", std::string("\xE0\x7F\x10\0OW\0\0\xF0\xFF\xFF\xFF", 12) + "four");
  expect_error(scratch / "long", "1.dcm");
  write_elements(scratch / "odd/1.dcm", std::string("\x08\0\x60\0CS\xFF\xFF", 8) + "CT");
  expect_error(scratch / "odd", "1.dcm");
  std::string noise = "DICM";
  std::mt19937 random(3);
  for (int i = 0; i < 5000; ++i) noise += static_cast<char>(random());
  fs::create_directory(scratch / "noise");
  std::ofstream(scratch / "noise/1.dcm", std::ios::binary) << std::string(128, '\0') << noise;
  expect_error(scratch / "noise", "1.dcm");
}

TEST(DicomHostile, ChangedBytesAreAnErrorOrAVolumeAndNothingHangs) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 3, {}, EXS_RLELossless);
  const std::string whole = testing::contents_of(scratch / "ct/2.dcm");
  std::mt19937 random(11);
  for (int i = 0; i < 60; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 4; ++k) bytes[132 + random() % (bytes.size() - 132)] = static_cast<char>(random());
    std::ofstream(scratch / "ct/2.dcm", std::ios::binary) << bytes;
    const auto ct = import_volume(scratch / "ct");
    if (!ct) {
      EXPECT_EQ(ct.error().what.find('\n'), std::string::npos) << ct.error().what;
    }
  }
}

TEST(DicomHostile, LinksInACircleEnd) {
  const Scratch scratch;
  write_ct_series(scratch / "ct", {}, 4);
  fs::create_directory_symlink(scratch.path(), scratch / "ct/up");
  expect_ct(scratch / "ct", 4, 0);
}

}  // namespace
}  // namespace birdseye::host
