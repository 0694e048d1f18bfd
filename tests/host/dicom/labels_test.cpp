#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>
#include <set>

#include "host/volume/import.hpp"
#include "host/volume/label_names.hpp"
#include "host/volume/labels.hpp"
#include "host/volume/segmentation.hpp"
#include "tests/support/dicom_segmentation.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::kSegColumns;
using testing::kSegRows;
using testing::put;
using testing::Scratch;
using testing::SegFrame;
using testing::Segmentation;
using testing::write_segmentation;

/// A CT of 9 x 7 x 6 voxels of the segmentations' spacing; the first at (-1, -1.5, -4).
Volume ct_around() {
  Volume ct;
  ct.size = {9, 7, 6};
  ct.spacing_mm = {0.5, 0.75, 2};
  ct.patient_from_voxel.linear() = ct.spacing_mm.asDiagonal();
  ct.patient_from_voxel.translation() = Eigen::Vector3d(-1, -1.5, -4);
  ct.hu.assign(grid_count(ct.size), 40);
  return ct;
}

using Places = std::set<std::array<int, 3>>;

/// The voxels of these labels.
Places places_of(const LabelVolume& labels, const std::vector<LabelChoice>& wanted) {
  const auto values = values_of_labels(labels.names, wanted, nullptr);
  EXPECT_TRUE(values) << values.error().what;
  Places places;
  if (!values) return places;
  for (int k = 0; k < labels.volume.size[2]; ++k) {
    for (int j = 0; j < labels.volume.size[1]; ++j) {
      for (int i = 0; i < labels.volume.size[0]; ++i) {
        if (std::count(values->begin(), values->end(), labels.volume.at(i, j, k)) > 0) places.insert({i, j, k});
      }
    }
  }
  return places;
}

/// Random frames of two segments that overlap, in random order with some left out; and where the voxels of each lie in
/// ct_around, of which the segmentation's first is (2, 2, 2).
Segmentation random_frames(unsigned seed, std::array<Places, 2>& truth) {
  std::mt19937 random(seed);
  Segmentation seg;
  for (int k = 0; k < 3; ++k) {
    for (int segment = 1; segment <= 2; ++segment) {
      if (k == 1 && segment == 2) continue;  // an empty frame is left out
      SegFrame frame{segment, {0, 0, 2.0 * k}, {}};
      for (int j = 0; j < kSegRows; ++j) {
        for (int i = 0; i < kSegColumns; ++i) {
          frame.pixels.push_back(static_cast<int>(random() % 2));
          if (frame.pixels.back() != 0) truth[static_cast<std::size_t>(segment - 1)].insert({i + 2, j + 2, k + 2});
        }
      }
      seg.frames.push_back(frame);
    }
  }
  std::shuffle(seg.frames.begin(), seg.frames.end(), random);
  return seg;
}

TEST(DicomSeg, FramesLieWhereTheirPlacesSayAndSegmentsMayOverlap) {
  const Scratch scratch;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::array<Places, 2> truth;
    const Segmentation seg = random_frames(seed, truth);
    for (const E_TransferSyntax syntax :
         {EXS_LittleEndianExplicit, EXS_LittleEndianImplicit, EXS_DeflatedLittleEndianExplicit}) {
      write_segmentation(scratch / "seg.dcm", seg, {}, syntax);
      const auto labels = import_named_labels(scratch / "seg.dcm", ct_around());
      ASSERT_TRUE(labels) << labels.error().what;
      EXPECT_EQ(places_of(*labels, {"liver"}), truth[0]);
      EXPECT_EQ(places_of(*labels, {2}), truth[1]);
      Places both = truth[0];
      both.insert(truth[1].begin(), truth[1].end());
      EXPECT_EQ(places_of(*labels, {"Liver", "portal_vein"}), both);
    }
  }
}

TEST(DicomSeg, FractionsBelongFromHalfOn) {
  const Scratch scratch;
  Segmentation seg;
  seg.type = "FRACTIONAL";  // of at most 200
  seg.frames = {{1, {0, 0, 0}, {0, 1, 99, 100, 101, 200, 0, 0, 0, 0, 0, 0, 0, 0, 150}}};
  write_segmentation(scratch / "seg.dcm", seg);
  const auto labels = import_named_labels(scratch / "seg.dcm", ct_around());
  ASSERT_TRUE(labels) << labels.error().what;
  EXPECT_EQ(places_of(*labels, {"liver"}), (Places{{5, 2, 2}, {6, 2, 2}, {2, 3, 2}, {6, 4, 2}}));
}

TEST(DicomSeg, AxesThatPointTheOtherWayAreTurned) {
  const Scratch scratch;
  Segmentation seg;
  seg.axes = "-1\\0\\0\\0\\-1\\0";  // the first pixel lies at the other corner
  SegFrame frame{1, {2, 1.5, 2}, std::vector<int>(15, 0)};
  frame.pixels[0] = 1;
  frame.pixels[1] = 1;
  seg.frames = {frame};
  write_segmentation(scratch / "seg.dcm", seg);
  const auto labels = import_named_labels(scratch / "seg.dcm", ct_around());
  ASSERT_TRUE(labels) << labels.error().what;
  EXPECT_EQ(places_of(*labels, {1}), (Places{{6, 4, 3}, {5, 4, 3}}));
}

TEST(DicomSeg, IsFoundBesideItsCt) {
  const Scratch scratch;
  testing::write_ct_series(scratch / "export/ct", {}, 4);
  Segmentation seg;
  seg.frames = {{1, {-0.5, 0, 2}, std::vector<int>(15, 1)}};  // reaches over the CT's edge by one voxel
  write_segmentation(scratch / "export/seg", seg);
  const auto ct = import_volume(scratch / "export");
  ASSERT_TRUE(ct) << ct.error().what;
  const auto labels = import_named_labels(scratch / "export", *ct);
  ASSERT_TRUE(labels) << labels.error().what;
  EXPECT_EQ(places_of(*labels, {"liver"}).size(), 12U);
  write_segmentation(scratch / "export/other", seg);
  EXPECT_NE(import_named_labels(scratch / "export", *ct).error().what.find("several segmentations"), std::string::npos);
}

void expect_no_labels(const fs::path& path, const std::string& why) {
  const auto labels = import_named_labels(path, ct_around());
  ASSERT_FALSE(labels) << "read, where it should say: " << why;
  EXPECT_NE(labels.error().what.find(why), std::string::npos) << labels.error().what;
  EXPECT_NE(labels.error().what.find(path.string()), std::string::npos) << labels.error().what;
  EXPECT_EQ(labels.error().what.find('\n'), std::string::npos) << labels.error().what;
}

TEST(DicomSeg, WhatDoesNotFitIsRefused) {
  const Scratch scratch;
  const fs::path path = scratch / "seg.dcm";
  Segmentation seg;
  const auto write_at = [&](std::vector<Eigen::Vector3d> places, const testing::Elements& more = {}) {
    seg.frames.clear();
    for (const auto& place : places) seg.frames.push_back({1, place, std::vector<int>(15, 1)});
    write_segmentation(path, seg, more);
  };
  write_at({{0.2, 0, 0}});
  expect_no_labels(path, "not on the grid");
  write_at({{100, 0, 0}});
  expect_no_labels(path, "outside of the CT");
  write_at({{0, 0, 0}, {0, 0, 2}, {0, 0, 4.9}});
  expect_no_labels(path, "uneven distances");
  write_at({{0, 0, 0}, {0.5, 0, 2}});
  expect_no_labels(path, "beside one another");
  write_at({{0, 0, 0}, {0, 0, 1e9}});
  expect_no_labels(path, "further than any CT");
  write_at({{0, 0, 0}}, [](DcmDataset& dataset) { put(dataset, DCM_Rows, 4000), put(dataset, DCM_Columns, 4000); });
  expect_no_labels(path, "cut short");
  write_at({{0, 0, 0}}, [](DcmDataset& dataset) { put(dataset, DCM_SegmentationType, "SURFACE"); });
  expect_no_labels(path, "type 'SURFACE'");
  write_at({{0, 0, 0}});
  const auto ct = import_volume(path);
  ASSERT_FALSE(ct);
  EXPECT_NE(ct.error().what.find("--labels"), std::string::npos) << ct.error().what;
}

/// The labels of patient B2 and of a frame of reference, over a CT of `frame`.
Result<LabelVolume> labels_over(const PatientFrame& frame, const char* uid) {
  const Scratch scratch;
  Segmentation seg;
  seg.frames = {{1, {0, 0, 0}, std::vector<int>(15, 1)}};
  write_segmentation(scratch / "seg.dcm", seg, [uid](DcmDataset& dataset) {
    put(dataset, DCM_PatientID, "B2");
    if (uid != nullptr) put(dataset, DCM_FrameOfReferenceUID, uid);
  });
  Volume ct = ct_around();
  ct.frame = frame;
  return import_named_labels(scratch / "seg.dcm", ct);
}

TEST(DicomSeg, OfAnotherPatientOrScanIsRefusedAndWhatNobodySaysIsNoted) {
  const auto same = labels_over({"B2", "2.25.1"}, "2.25.1");
  ASSERT_TRUE(same) << same.error().what;
  EXPECT_TRUE(same->notes.empty()) << same->notes.front();
  const auto other = labels_over({"A1", "2.25.1"}, "2.25.1");
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("seg.dcm: is of patient B2, and the CT of patient A1"), std::string::npos)
      << other.error().what;
  const auto scan = labels_over({"B2", "2.25.1"}, "2.25.12");
  ASSERT_FALSE(scan);
  EXPECT_NE(scan.error().what.find("is of another scan than the CT"), std::string::npos) << scan.error().what;
  for (const auto& [ct, uid, lacks] : {std::tuple{PatientFrame{}, "2.25.1", "the CT has no frame of reference"},
                                       std::tuple{PatientFrame{"B2", "2.25.1"}, static_cast<const char*>(nullptr),
                                                  "seg.dcm: has no frame of reference"}}) {
    const auto labels = labels_over(ct, uid);
    ASSERT_TRUE(labels) << labels.error().what;
    ASSERT_EQ(labels->notes.size(), 1U);
    EXPECT_NE(labels->notes[0].find(lacks), std::string::npos) << labels->notes[0];
  }
}

TEST(DicomSeg, OfAnotherPatientInTheFolderOfTheCtIsRefused) {
  const Scratch scratch;
  testing::write_ct_series(scratch / "export/ct", {}, 4,
                           [](DcmDataset& dataset) { put(dataset, DCM_PatientID, "A1"); });
  Segmentation seg;
  seg.frames = {{1, {-0.5, 0, 2}, std::vector<int>(15, 1)}};
  write_segmentation(scratch / "export/seg", seg, [](DcmDataset& dataset) { put(dataset, DCM_PatientID, "B2"); });
  const auto ct = import_volume(scratch / "export");
  ASSERT_TRUE(ct) << ct.error().what;
  EXPECT_EQ(ct->frame.patient_id, "A1");
  const auto labels = import_named_labels(scratch / "export", *ct);
  ASSERT_FALSE(labels);
  EXPECT_NE(labels.error().what.find("is of patient B2"), std::string::npos) << labels.error().what;
}

TEST(LabelNames, AreChosenWhateverTheirCapitalsAndBlanks) {
  const std::vector<NamedLabel> names{{1, "Liver", {1, 4}}, {2, "Portal Vein", {2, 4}}, {3, "Tumour", {3}}};
  const std::vector<LabelChoice> wanted{"liver", "portal_vein", 3, 9};
  EXPECT_EQ(*values_of_labels(names, wanted, nullptr), (std::vector<int>{1, 4, 2, 4, 3, 9}));
  const auto none = values_of_labels(names, std::vector<LabelChoice>{"spleen"}, nullptr);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("has no label 'spleen'; it has Liver, Portal Vein, Tumour"), std::string::npos);
}

TEST(LabelNames, AreTotalSegmentatorsWhereTheFileHasNone) {
  std::vector<std::string> notes;
  const std::vector<LabelChoice> wanted{"liver", "portal_vein_and_splenic_vein", "spleen", "costal_cartilages"};
  EXPECT_EQ(*values_of_labels({}, wanted, &notes), (std::vector<int>{5, 64, 1, 117}));
  ASSERT_EQ(notes.size(), 4U);
  EXPECT_NE(notes[0].find("'liver' is taken for 5, as TotalSegmentator 2 counts"), std::string::npos) << notes[0];
  EXPECT_FALSE(values_of_labels({}, std::vector<LabelChoice>{"tumour"}, nullptr));
  const auto unnamed = values_of_labels({{5, "", {5}}}, std::vector<LabelChoice>{"liver"}, nullptr);
  ASSERT_FALSE(unnamed) << "a list of segments that are not TotalSegmentator's";
  EXPECT_NE(unnamed.error().what.find("names none of its labels; give the label's number"), std::string::npos);
}

/// A NIfTI file of 9 x 7 x 6 labels on the grid of ct_around, all `label` but for a border, with this extension.
void write_nifti(const fs::path& path, std::uint8_t label, const std::string& extension) {
  std::array<char, 352> header{};
  const auto put_at = [&header](std::size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof value); };
  const std::size_t esize = extension.empty() ? 0 : (extension.size() + 8 + 15) / 16 * 16;
  put_at(0, std::int32_t{348});
  for (std::size_t i = 0; i < 4; ++i) put_at(40 + 2 * i, std::array<std::int16_t, 4>{3, 9, 7, 6}[i]);
  put_at(70, std::int16_t{2});
  put_at(72, std::int16_t{8});
  for (std::size_t i = 0; i < 4; ++i) put_at(76 + 4 * i, std::array<float, 4>{1, 0.5F, 0.75F, 2}[i]);
  put_at(108, static_cast<float>(352 + esize));
  put_at(254, std::int16_t{1});  // sform: RAS, so x and y are turned
  for (std::size_t row = 0; row < 3; ++row) {
    const std::array<std::array<float, 4>, 3> rows{{{-0.5F, 0, 0, 1}, {0, -0.75F, 0, 1.5F}, {0, 0, 2, -4}}};
    for (std::size_t i = 0; i < 4; ++i) put_at(280 + 16 * row + 4 * i, rows[row][i]);
  }
  std::memcpy(header.data() + 344, "n+1", 4);
  header[348] = extension.empty() ? 0 : 1;
  std::string bytes(header.data(), header.size());
  if (esize > 0) {
    const std::array<std::int32_t, 2> head{static_cast<std::int32_t>(esize), 0};
    bytes.append(reinterpret_cast<const char*>(head.data()), 8);
    bytes += extension;
    bytes.resize(352 + esize, '\0');
  }
  for (int i = 0; i < 9 * 7 * 6; ++i) bytes += static_cast<char>(i % 9 == 4 ? label : 0);
  const gzFile file = gzopen(path.c_str(), "wb");
  ASSERT_EQ(gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size())), static_cast<int>(bytes.size()));
  gzclose(file);
}

TEST(LabelNames, OfANiftiFileAreItsOwnBeforeAnybodyElses) {
  const Scratch scratch;
  write_nifti(scratch / "plain.nii.gz", 5, "");
  const auto plain = import_named_labels(scratch / "plain.nii.gz", ct_around());
  ASSERT_TRUE(plain) << plain.error().what;
  EXPECT_EQ(places_of(*plain, {"liver"}).size(), 42U);
  write_nifti(scratch / "named.nii.gz", 2,
              "<?xml version=\"1.0\" encoding=\"UTF-8\"?> <CaretExtension><VolumeInformation Index=\"0\"><LabelTable>\n"
              "<Label Key=\"1\" Red=\"0.0\" Green=\"1\" Blue=\"0\" Alpha=\"1\"><![CDATA[liver_vessels]]></Label>\n"
              "<Label Key=\"2\" Red=\"0.0\" Green=\"1\" Blue=\"0\" Alpha=\"1\">liver_tumor</Label>\n"
              "</LabelTable></VolumeInformation></CaretExtension>");
  const auto named = import_named_labels(scratch / "named.nii.gz", ct_around());
  ASSERT_TRUE(named) << named.error().what;
  EXPECT_EQ(places_of(*named, {"liver_tumor"}).size(), 42U);
  EXPECT_TRUE(places_of(*named, {"liver_vessels"}).empty());
  EXPECT_FALSE(values_of_labels(named->names, std::vector<LabelChoice>{"liver"}, nullptr));
}

/// What a NIfTI file's labels are called, or why not.
Result<std::vector<NamedLabel>> names_by(const std::string& extension) {
  const Scratch scratch;
  write_nifti(scratch / "odd.nii.gz", 5, extension);
  const auto labels = import_named_labels(scratch / "odd.nii.gz", ct_around());
  if (!labels) return labels.error();
  return labels->names;
}

std::string table_of(const std::string& labels) {
  return "<?xml version=\"1.0\"?><CaretExtension><VolumeInformation><LabelTable>" + labels +
         "</LabelTable></VolumeInformation></CaretExtension>";
}

TEST(LabelNames, ThatCannotBeReadAreNoReasonToTakeThoseOfTotalSegmentator) {
  const std::string table =
      table_of("<Label Key=\"5\" Red=\"0\"><![CDATA[spleen]]></Label> <Label Key=\"6\"><![CDATA[liver]]></Label>\n");
  ASSERT_TRUE(names_by(table));
  for (std::size_t length = 1; length < table.size(); ++length) {
    const auto cut = names_by(table.substr(0, length));
    ASSERT_FALSE(cut) << table.substr(0, length);
    EXPECT_NE(cut.error().what.find("odd.nii.gz: its table of label names is damaged"), std::string::npos)
        << cut.error().what;
  }
  const std::array<std::string, 8> damaged{"<Label Key=\"5",
                                           "</Label><Label ",
                                           table_of("<Label Key=\"99999999999\">liver</Label>"),
                                           table_of("<Label Key=\"5x\">liver</Label>"),
                                           table_of("<Label >liver</Label>"),
                                           table_of("<Lable Key=\"5\">liver</Lable>"),
                                           table_of("<Label Key=\"5\">liver &unknown;</Label>"),
                                           std::string(3000, 'a').insert(0, "<a><a>")};
  for (const std::string& text : damaged) EXPECT_FALSE(names_by(text)) << text;
  const auto both = names_by(table_of("<Label Key=\"5\">liver</Label><Label Key=\"5\">spleen</Label>"));
  ASSERT_FALSE(both);
  EXPECT_NE(both.error().what.find("calls label 5 both 'liver' and 'spleen'"), std::string::npos) << both.error().what;
}

TEST(LabelNames, OfOtherExtensionsAreNoneAndReferencesAreRead) {
  for (const std::string& other :
       {std::string("a comment, 3 < 4"), std::string("<AFNI_attributes a=\"1\"></AFNI_attributes>"),
        std::string("<!-- none --><CaretExtension/>"), table_of(""), std::string("\x08\0\x05\0\x10\0", 6)}) {
    const auto names = names_by(other);
    ASSERT_TRUE(names) << names.error().what;
    EXPECT_TRUE(names->empty()) << other;
  }
  const auto names = names_by(table_of("<Label Key=\"5\">liver &amp; gall&#x27;s</Label>"));
  ASSERT_TRUE(names) << names.error().what;
  ASSERT_EQ(names->size(), 1U);
  EXPECT_EQ(names->front().name, "liver & gall's");
}

/// A folder of one mask a file, as TotalSegmentator writes it, of a small CT.
class MaskFolder : public ::testing::Test {
 protected:
  MaskFolder() {
    ct_.size = {6, 5, 4};
    ct_.spacing_mm = {0.7, 0.7, 1.5};
    ct_.patient_from_voxel = Eigen::Translation3d(-20, 10, 5) * Eigen::Scaling(0.7, 0.7, 1.5);
    ct_.hu.assign(grid_count(ct_.size), 40);
    mask("liver", [](int i, int, int) { return i < 4; });
    mask("my_tumour", [](int i, int j, int) { return i == 3 && j == 2; });
    mask("portal_vein_and_splenic_vein", [](int i, int j, int) { return i == 5 && j < 2; });
    (void)scratch_.file("masks/report.json", "{}");
  }
  void mask(const std::string& name, const std::function<bool(int, int, int)>& inside) {
    Volume out = ct_;
    for (int k = 0; k < out.size[2]; ++k) {
      for (int j = 0; j < out.size[1]; ++j) {
        for (int i = 0; i < out.size[0]; ++i) out.hu[out.index(i, j, k)] = inside(i, j, k) ? 1 : 0;
      }
    }
    fs::create_directories(folder_);
    ASSERT_TRUE(write_labels(folder_ / (name + ".nii.gz"), out));
  }
  /// How many voxels have a structure.
  static std::ptrdiff_t count(const LabelVolume& labels, const char* name) {
    const auto values = values_of_labels(labels.names, std::vector<LabelChoice>{name}, nullptr);
    EXPECT_TRUE(values) << values.error().what;
    return std::count_if(labels.volume.hu.begin(), labels.volume.hu.end(), [&](std::int16_t value) {
      return std::find(values->begin(), values->end(), value) != values->end();
    });
  }
  Scratch scratch_;
  fs::path folder_ = scratch_ / "masks";
  Volume ct_;
};

TEST_F(MaskFolder, IsASegmentationWithTheFilesNames) {
  const auto labels = import_named_labels(folder_, ct_);
  ASSERT_TRUE(labels) << labels.error().what;
  EXPECT_EQ(count(*labels, "liver"), 4 * 5 * 4);
  EXPECT_EQ(count(*labels, "My tumour"), 4) << "which is within the liver";
  EXPECT_EQ(count(*labels, "portal_vein_and_splenic_vein"), 2 * 4);
  EXPECT_EQ(count(*labels, "5"), 4 * 5 * 4) << "the liver's number";
  const auto none = values_of_labels(labels->names, std::vector<LabelChoice>{"spleen"}, nullptr);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("liver, my_tumour, portal"), std::string::npos) << none.error().what;
}

TEST_F(MaskFolder, OnlyWhatIsWantedIsRead) {
  (void)scratch_.file("masks/spleen.nii.gz", "damaged");
  const auto liver = import_named_labels(folder_, ct_, std::vector<LabelChoice>{"liver", "201"});
  ASSERT_TRUE(liver) << liver.error().what;
  EXPECT_EQ(count(*liver, "liver"), 4 * 5 * 4);
  EXPECT_EQ(count(*liver, "my_tumour"), 4) << "the first that TotalSegmentator does not know";
  EXPECT_EQ(count(*liver, "portal_vein_and_splenic_vein"), 0);
  const auto all = import_named_labels(folder_, ct_);
  ASSERT_FALSE(all);
  EXPECT_NE(all.error().what.find("spleen.nii.gz"), std::string::npos) << all.error().what;
}

TEST_F(MaskFolder, OfAnotherCtIsRefusedByTheFilesName) {
  ct_.spacing_mm.x() = 0.9;
  ct_.patient_from_voxel = Eigen::Translation3d(-20, 10, 5) * Eigen::Scaling(0.9, 0.7, 1.5);
  const auto labels = import_named_labels(folder_, ct_);
  ASSERT_FALSE(labels);
  EXPECT_NE(labels.error().what.find("liver.nii.gz: is not on the grid"), std::string::npos) << labels.error().what;
}

}  // namespace
}  // namespace birdseye::host
