#include "host/volume/stated_geometry.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "host/volume/image_file.hpp"
#include "host/volume/import.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using testing::Scratch;

const std::string kNrrd = "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: raw\n";
const std::string kMeta = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\n";

TEST(StatedGeometry, ATextHeaderSaysWhereTheVoxelsLieOrWhatItLacks) {
  const Scratch scratch;
  const std::string directions = "space directions: (1,0,0) (0,1,0) (0,0,2)\n";
  const std::string turn = "TransformMatrix = 1 0 0 0 1 0 0 0 1\n", local = "ElementDataFile = LOCAL\n";
  struct Header {
    std::string name, text, spacing, orientation, beyond;  // what is said of each gap; empty: there is none
  };
  for (const Header& h : std::vector<Header>{
           {"a.nrrd", kNrrd + "space: left-posterior-superior\n" + directions + "\n", "", "", ""},
           {"b.nrrd", kNrrd + "space: RAS\r\nspace directions: (1,0,0) (0,1,0) (0,0,2)\r\n\r\n", "", "", ""},
           {"c.nrrd", kNrrd + "space dimension: 3\n" + directions + "\n", "", "\"space\"", ""},
           {"d.nrrd", kNrrd + "spacings: 1 1 2\n\n", "", "\"space\"", ""},
           {"e.nrrd", kNrrd + "space: scanner-xyz\n" + directions + "\n", "", "scanner-xyz", ""},
           {"f.nrrd", kNrrd + "space: LPS\nspacings: 1 1 2\n\n", "", "space directions", ""},
           {"k.nrrd", kNrrd + "space: LPS\nspacings: 1 1 nan\n\n", "spacings", "space directions", ""},
           {"l.nrrd", kNrrd + "space: LPS\nspace units: \"m\" \"m\" \"m\"\n" + directions + "\n", "", "", "in mm"},
           {"m.nrrd", kNrrd + "space: LPS\nspace units: \"mm\" \"mm\" \"mm\"\n" + directions + "\n", "", "", ""},
           {"s.nrrd", kNrrd + "space: LPS\nspace directions: none (0,2,0) (0,0,2)\n\n", "along each axis (its",
            "which way each of its axes", ""},
           {"t.nrrd", kNrrd + "space: LPS\nspace directions: none none none\n\n", "are none none none", "each of", ""},
           {"u.nrrd", kNrrd + "space: LPS\nspace directions: (1,0,0) (nan,nan,nan) (0,0,2)\n\n", "along each axis",
            "each of", ""},
           {"v.nrrd", kNrrd + "space: LPS\nspace directions: none (1,0,0) (0,1,0) (0,0,2)\n\n", "", "", ""},
           {"s.mha", kMeta + turn + "ElementSpacing = 1 1 2\nDistanceUnits = cm\n" + local, "", "", "in cm (Dist"},
           {"t.mha", kMeta + turn + "ElementSpacing = 1 1 2\nDistanceUnits = mm\n" + local, "", "", ""},
           {"u.mha", kMeta + turn + "ElementSpacing = 1 1 2\nDistanceUnits = ?\n" + local, "", "", ""},
           {"g.mha", kMeta + turn + "ElementSpacing = 1 1 2\n" + local, "", "", ""},
           {"h.mha", kMeta + turn + local + "ElementSpacing = 1 1 2\n", "ElementSpacing", "", ""},
           {"n.mha", kMeta + turn + "ElementSpacing = 1 1 0\n" + local, "ElementSpacing", "", ""},
           {"o.mha", kMeta + turn + "ElementSpacing = 1 1 2\nElementSize = 1 1 3\n" + local, "ElementSize", "", ""},
           {"p.mha", kMeta + "ElementSpacing = 1 1 2\n" + local, "", "TransformMatrix", ""},
           {"q.mha", kMeta + turn + "AnatomicalOrientation = RAI\nElementSpacing = 1 1 2\n" + local, "", "", ""},
           {"r.mha", kMeta + turn + "AnatomicalOrientation = LAI\nElementSpacing = 1 1 2\n" + local, "",
            "LPS by its TransformMatrix, RPS by", ""},
           {"i.mhd", "NDims = -1e308\nElementSpacing = 1 1 2\nElementDataFile = i.raw\n", "", "", "NDims"},
           {"j.nii", "anything", "", "", ""}}) {
    const GeometryGaps gaps = text_header_gaps(scratch.file(h.name, h.text));
    for (const auto& [told, lacks] :
         {std::pair{gaps.spacing, h.spacing}, {gaps.orientation, h.orientation}, {gaps.beyond, h.beyond}}) {
      EXPECT_EQ(told.empty(), lacks.empty()) << h.name << ": " << told;
      EXPECT_NE(told.find(lacks), std::string::npos) << h.name << ": " << told;
    }
  }
}

TEST(StatedGeometry, ATextHeaderThatSaysOneThingTwiceDifferentlyIsNamed) {
  const Scratch scratch;
  const std::string directions = "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n";
  const std::string meta = kMeta + "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementSpacing = 1 1 2\n";
  const std::string local = "ElementDataFile = LOCAL\n";
  struct Header {
    std::string name, text, place, beyond;  // what is said of each; empty: nothing
  };
  for (const Header& h : std::vector<Header>{
           {"a.nrrd", kNrrd + directions + "space origin: (1,2,3)\n\n", "", ""},
           {"b.nrrd", kNrrd + directions + "\n", "no \"space origin\"", ""},
           {"c.nrrd", kNrrd + directions + "space origin: (nan,nan,nan)\n\n", "no \"space origin\"", ""},
           {"d.nrrd", kNrrd + directions + "space origin: (1,2,3)\nspace origin: (1,2,4)\n\n", "", "\"space origin\""},
           {"e.nrrd", kNrrd + directions + "space origin: (1,2,3)\nspace origin: (1,2,3)\n\n", "", ""},
           {"f.nrrd",
            "NRRD0004\n# see http://a\n# see http://b\n" + kNrrd.substr(9) + directions + "k:=1\nk:=2\n" +
                "space origin: (1,2,3)\n\n",
            "", ""},
           {"g.mha", meta + "Offset = 1 2 3\n" + local, "", ""},
           {"h.mha", meta + "Position = 1 2 3\n" + local, "", ""},
           {"i.mha", meta + local, "no Offset", ""},
           {"j.mha", meta + "Offset = 1 2 3\nOrigin = 1.0 2.0 3\n" + local, "", ""},
           {"k.mha", meta + "Offset = 1 2 3\nOrigin = 1 2 4\n" + local, "", "Offset 1 2 3, Origin 1 2 4"},
           {"l.mha", meta + "Position = 1 2 3\nOrigin = 1 2\n" + local, "", "Position 1 2 3, Origin 1 2"},
           {"m.mha", meta + "Offset = 1 2 3\nRotation = 1 0 0 0 1 0 0 0 1\n" + local, "", ""},
           {"n.mha", meta + "Offset = 1 2 3\nOrientation = -1 0 0 0 -1 0 0 0 1\n" + local, "",
            "TransformMatrix 1 0 0 0 1 0 0 0 1, Orientation -1 0 0"},
           {"o.mha", meta + "Offset = 1 2 3\nElementSpacing = 1 1 3\n" + local, "", "\"ElementSpacing\" twice"}}) {
    const GeometryGaps gaps = text_header_gaps(scratch.file(h.name, h.text));
    for (const auto& [told, says] : {std::pair{gaps.place, h.place}, {gaps.beyond, h.beyond}}) {
      EXPECT_EQ(told.empty(), says.empty()) << h.name << ": " << told;
      EXPECT_NE(told.find(says), std::string::npos) << h.name << ": " << told;
    }
  }
}

using Size = std::array<int, 3>;

/// A NIfTI-1 file of water: the codes of its two geometries, by how much they lie apart along x, and which way the
/// sform's x points.
std::string nifti(std::int16_t quaternion, std::int16_t matrix, float apart_mm, float x_way = 1,
                  const Size& size = {4, 3, 2}) {
  std::string file(352 + 2 * grid_count(size), '\0');
  const auto put = [&file](std::size_t at, auto value) { std::memcpy(file.data() + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  put(40, std::int16_t{3});
  for (std::size_t axis = 0; axis < 7; ++axis) put(42 + 2 * axis, static_cast<std::int16_t>(axis < 3 ? size[axis] : 1));
  put(70, std::int16_t{4});
  put(72, std::int16_t{16});
  for (std::size_t at = 76; at < 92; at += 4) put(at, 1.0F);
  put(108, 352.0F);
  put(112, 1.0F);
  file[123] = 2;
  put(252, quaternion);
  put(254, matrix);
  for (std::size_t k = 0; k < 3; ++k) {
    put(268 + 4 * k, 10.0F);
    put(280 + 20 * k, k == 0 ? x_way : 1.0F);
    put(292 + 16 * k, k == 0 ? 10.0F + apart_mm : 10.0F);
  }
  std::memcpy(file.data() + 344, "n+1", 4);
  return file;
}

std::string with_number(std::string file, std::size_t at, float value) {
  std::memcpy(file.data() + at, &value, sizeof value);
  return file;
}

void expect_refused(const Result<Volume>& read, const std::string& name, const std::string& why) {
  ASSERT_FALSE(read) << name;
  EXPECT_NE(read.error().what.find(name), std::string::npos) << read.error().what;
  EXPECT_NE(read.error().what.find(why), std::string::npos) << read.error().what;
}

TEST(StatedGeometry, ANiftiFileSaysOnePlaceForItsVoxels) {
  const Scratch scratch;
  EXPECT_TRUE(import_volume(fs::path(scratch.file("both.nii", nifti(1, 1, 0.0F)))));
  EXPECT_TRUE(import_volume(fs::path(scratch.file("by_matrix.nii", nifti(0, 2, 30.0F)))));
  EXPECT_TRUE(import_volume(fs::path(scratch.file("by_quaternion.nii", nifti(1, 0, 30.0F)))));
  EXPECT_TRUE(import_volume(fs::path(scratch.file("rounded.nii", nifti(1, 1, 0.01F)))));
  EXPECT_TRUE(import_volume(fs::path(scratch.file("half_turn.nii", with_number(nifti(1, 0, 0.0F), 264, 1.0001F)))));
  for (const auto& [name, text, why] : std::vector<std::array<std::string, 3>>{
           {"none.nii", nifti(0, 0, 0.0F), "neither its qform nor its sform"},
           {"two.nii", nifti(1, 1, 12.0F), "12.0 mm apart"},
           {"mirrored.nii", nifti(1, 1, 0.0F, -1), "differ (RAS and LAS)"},
           {"wide.nii", nifti(0, 1, 0.0F, 3), "two spacings"},
           {"unspaced.nii", with_number(nifti(1, 0, 0.0F), 88, 0), "a pixdim is not above 0"},
           {"sheared.nii", with_number(nifti(0, 1, 0.0F), 284, 0.5F), "sheared"},
           {"rounded_alone.nii", with_number(nifti(0, 1, 0.0F), 88, 1.002F), "1.002 by its pixdim, 1 x 1 x 1 by its"},
           {"mni.nii", nifti(0, 4, 0.0F), "the MNI152 atlas (sform code 4)"},
           {"talairach.nii", nifti(3, 3, 0.0F), "Talairach's atlas (qform code 3)"},
           {"template.nii", nifti(0, 5, 0.0F), "of an atlas (sform code 5)"},
           {"both.nii", nifti(1, 4, 12.0F), "its sform is in the space of the MNI152 atlas"},
           {"unknown.nii", nifti(1, 9, 0.0F), "the sform code 9"},
           {"negative.nii", nifti(-1, 1, 0.0F), "the qform code -1"},
           {"no_rotation.nii", with_number(nifti(1, 0, 0.0F), 256, 1.2F),
            "its quaternion (1.2, 0, 0) is longer than 1"},
           {"far.nii", nifti(1, 1, 3.4e38F), "header"}}) {
    expect_refused(import_volume(fs::path(scratch.file(name, text))), name, why);
  }
}

/// Of a file in the scratch folder, with what a person states.
VolumeSource stated(const fs::path& path, const std::optional<Eigen::Vector3d>& spacing_mm,
                    const std::string& orientation) {
  VolumeSource source(path);
  source.stated.spacing_mm = spacing_mm;
  source.stated.orientation = orientation;
  return source;
}

std::string voxels(const Size& size) {
  return std::string(2 * grid_count(size), '\0');
}

// The attacker's files, and the same defects in a volume that is large enough for a CT.
TEST(StatedGeometry, WhatAFileDoesNotSayAPersonMayStateAndNothingElse) {
  const Scratch scratch;
  const Size size{60, 60, 60};
  const Eigen::Vector3d thick(1, 1, 2);
  const std::string nrrd = "NRRD0004\ntype: short\ndimension: 3\nsizes: 60 60 60\nendian: little\nencoding: raw\n";
  const std::string meta =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = 60 60 60\n"
      "ElementType = MET_SHORT\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 5 6 7\n";
  const fs::path nocode = scratch.file("nocode.nii", nifti(0, 0, 0.0F, 1, size));
  const fs::path conflict = scratch.file("conflict.nii", nifti(1, 1, 59.0F, -1, size));
  const fs::path nospace = scratch.file("nospace.nrrd", nrrd + "spacings: 1 1 2\n\n" + voxels(size));
  const fs::path nospacing = scratch.file("nospc.mha", meta + "ElementDataFile = LOCAL\n" + voxels(size));
  const fs::path whole =
      scratch.file("whole.mha", meta + "ElementSpacing = 1 1 2\nElementDataFile = LOCAL\n" + voxels(size));
  for (const auto& [path, why, option] : {std::tuple{nocode, "neither its qform nor its sform", "--orientation"},
                                          {conflict, "its qform and its sform differ (RAS and LAS)", "--orientation"},
                                          {nospace, "it has no \"space\"", "--orientation"},
                                          {nospacing, "it has no ElementSpacing", "--spacing"}}) {
    const auto read = import_volume(path);
    expect_refused(read, path.string(), why);
    EXPECT_NE(read.error().what.find(option), std::string::npos) << read.error().what;
    // No option states where labels lie.
    const auto labels = read_labels_file(path);
    ASSERT_FALSE(labels);
    EXPECT_NE(labels.error().what.find(why), std::string::npos) << labels.error().what;
    EXPECT_EQ(labels.error().what.find(option), std::string::npos) << labels.error().what;
  }

  auto read = import_with_notes(stated(nocode, std::nullopt, "PIL"));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(orientation_letters(read->volume.patient_from_voxel), "PIL");
  EXPECT_EQ(read->volume.patient_from_voxel.translation(), Eigen::Vector3d::Zero());
  ASSERT_EQ(read->notes.size(), 1U);
  EXPECT_NE(read->notes.front().find("its orientation, PIL, was stated by a person"), std::string::npos);
  // What lies in a matrix that no code says to be set is no place, and what letters it has does not matter.
  const fs::path unset = scratch.file("unset.nii", nifti(0, 0, 59.0F, -1, size));
  for (const char* letters : {"LAS", "RAS"}) {
    read = import_with_notes(stated(unset, std::nullopt, letters));
    ASSERT_TRUE(read) << read.error().what;
    EXPECT_EQ(orientation_letters(read->volume.patient_from_voxel), letters);
    EXPECT_EQ(read->volume.patient_from_voxel.translation(), Eigen::Vector3d::Zero());
    ASSERT_EQ(read->notes.size(), 1U);
    EXPECT_NE(read->notes.front().find("the file does not say it, nor where"), std::string::npos);
  }
  // Of two that the file says, the one that is stated, with its place: RAS grows from the right, LAS from the left.
  for (const auto& [letters, first_x_mm] : {std::pair{"RAS", -10.0}, {"LAS", -69.0}}) {
    read = import_with_notes(stated(conflict, std::nullopt, letters));
    ASSERT_TRUE(read) << read.error().what;
    EXPECT_EQ(orientation_letters(read->volume.patient_from_voxel), letters);
    EXPECT_NEAR(read->volume.patient_from_voxel.translation().x(), first_x_mm, 1e-4);
  }
  expect_refused(import_volume(stated(conflict, std::nullopt, "LPS")), "conflict.nii", "neither of these");
  read = import_with_notes(stated(nospace, std::nullopt, "LPS"));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->volume.spacing_mm, thick);
  read = import_with_notes(stated(nospacing, thick, ""));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->volume.spacing_mm, thick);
  EXPECT_EQ(read->volume.patient_from_voxel.linear().diagonal(), thick);
  EXPECT_EQ(read->volume.patient_from_voxel.translation(), Eigen::Vector3d(5, 6, 7));
  ASSERT_EQ(read->notes.size(), 1U);
  EXPECT_NE(read->notes.front().find("its spacing, 1 x 1 x 2 mm, was stated by a person"), std::string::npos);

  ASSERT_TRUE(import_volume(whole));
  expect_refused(import_volume(stated(whole, thick, "")), "whole.mha", "itself: leave --spacing");
  expect_refused(import_volume(stated(whole, std::nullopt, "LPS")), "whole.mha", "itself: leave --orientation");
  expect_refused(import_volume(stated(nospace, thick, "LPS")), "nospace.nrrd", "itself: leave --spacing");
  expect_refused(import_volume(stated(nospacing, std::nullopt, "LPS")), "nospc.mha", "ElementSpacing");
  // One axis of three has no direction: a person has to say both.
  const fs::path partly =
      scratch.file("partly.nrrd", nrrd + "space: LPS\nspace directions: none (0,1,0) (0,0,2)\n\n" + voxels(size));
  expect_refused(import_volume(partly), "partly.nrrd", "--spacing");
  expect_refused(import_volume(stated(partly, thick, "")), "partly.nrrd", "--orientation");
  read = import_with_notes(stated(partly, thick, "LPS"));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->volume.spacing_mm, thick);
}

TEST(StatedGeometry, AFileThatDoesNotSayWhereItsFirstVoxelLiesIsReadWithANote) {
  const Scratch scratch;
  const std::string meta = kMeta + "BinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = 1 1 2\n" +
                           "TransformMatrix = 1 0 0 0 1 0 0 0 1\n";
  const std::string local = "ElementDataFile = LOCAL\n" + voxels({4, 3, 2});
  const auto placed = import_with_notes(scratch.file("placed.mha", meta + "Position = 1 2 3\n" + local));
  ASSERT_TRUE(placed) << placed.error().what;
  EXPECT_EQ(placed->volume.patient_from_voxel.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(placed->notes.empty());
  const auto unplaced = import_with_notes(scratch.file("unplaced.mha", meta + local));
  ASSERT_TRUE(unplaced) << unplaced.error().what;
  ASSERT_EQ(unplaced->notes.size(), 1U);
  EXPECT_NE(unplaced->notes.front().find("does not say where its first voxel lies"), std::string::npos);
  // A displacement field is nothing without its place.
  const std::string field = "NRRD0004\ntype: float\ndimension: 4\nspace: LPS\nsizes: 3 4 3 2\nendian: little\n" +
                            std::string("encoding: raw\nkinds: vector domain domain domain\n") +
                            "space directions: none (1,0,0) (0,1,0) (0,0,2)\n";
  const std::string numbers(4 * 3 * 24, '\0');
  EXPECT_TRUE(read_image(scratch.file("field.nrrd", field + "space origin: (1,2,3)\n\n" + numbers), 3));
  const auto refused = read_image(scratch.file("nowhere.nrrd", field + "\n" + numbers), 3);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("no \"space origin\""), std::string::npos) << refused.error().what;
}

// Whatever the reason for which a reader takes a header otherwise than it is written.
TEST(StatedGeometry, AMetaImageIsReadAsItsHeaderIsWritten) {
  const Scratch scratch;
  const std::string turn = "TransformMatrix = 0 1 0 -1 0 0 0 0 1\n", place = "Offset = 5 6 7\nOrigin = 5 6 7.0001\n";
  const std::string text = kMeta + turn + place + "ElementSpacing = 1 1 2\nElementDataFile = LOCAL\n";
  const fs::path path = scratch.file("a.mha", text + voxels({4, 3, 2}));
  const auto read = read_image(path, 1);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(misread_geometry(path, *read), "");
  const auto told_of = [&](const auto& change) {
    ImageFile other = *read;
    change(other);
    return misread_geometry(path, other);
  };
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NE(told_of([axis](ImageFile& i) { i.spacing_mm[axis] += 0.001; }).find("ElementSpacing 1 1 2"),
              std::string::npos);
    EXPECT_NE(told_of([axis](ImageFile& i) { i.origin_mm[axis] = 0; }).find("Offset 5 6 7"), std::string::npos);
    EXPECT_NE(told_of([axis](ImageFile& i) { i.axes.col(axis) *= -1; }).find("TransformMatrix 0 1 0 -1 0 0 0 0 1"),
              std::string::npos);
  }
  // Where a person states which of two spacings is right, the reader takes the first.
  const fs::path two = scratch.file("two.mha", kMeta + turn + place + "ElementSize = 1 1 3\nElementSpacing = 1 1 2\n" +
                                                   "ElementDataFile = LOCAL\n" + voxels({4, 3, 2}));
  EXPECT_TRUE(import_volume(stated(two, Eigen::Vector3d(1, 1, 3), "")));
  // Of its Offset the reader takes what is said behind it by another name.
  expect_refused(import_volume(fs::path(scratch.file(
                     "other.mha", kMeta + turn + place + "ImagePosition = 7 8 9\n" +
                                      "ElementSpacing = 1 1 2\nElementDataFile = LOCAL\n" + voxels({4, 3, 2})))),
                 "other.mha", "says Offset 5 6 7 in its header, of which 7 8 9 is read");
}

TEST(StatedGeometry, TheVectorsOfAFieldAreThePatientsOrRefused) {
  const Scratch scratch;
  const auto field = [&](const std::string& name, const std::string& space, const std::string& frame) {
    return scratch.file(name,
                        "NRRD0005\ntype: float\ndimension: 4\nspace: " + space +
                            "\nsizes: 3 4 3 2\nendian: little\nencoding: raw\nkinds: vector domain domain domain\n"
                            "space directions: none (1,0,0) (0,1,0) (0,0,2)\nspace origin: (1,2,3)\n" +
                            frame + "\n" + std::string(4 * 3 * 24, '\0'));
  };
  const std::string same = "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n";
  const std::string turned = "measurement frame: (-1,0,0) (0,-1,0) (0,0,1)\n";
  for (const auto& [space, frame, why] : std::vector<std::array<std::string, 3>>{
           {"LPS", "", ""},
           {"left-posterior-superior", same, ""},
           {"Left-Posterior-Superior", "measurementframe: (1,0,0) (0,1.0,0) (0,0,1)\n", ""},
           {"LPS", turned, "\"measurement frame\" (-1,0,0) (0,-1,0) (0,0,1), by which its vectors are not turned"},
           {"LPS", "measurementframe: (0,1,0) (1,0,0) (0,0,1)\n", "\"measurement frame\" (0,1,0)"},
           {"LPS", "measurement frame: (nan,nan,nan) (nan,nan,nan) (nan,nan,nan)\n", "\"measurement frame\" (nan"},
           {"RAS", "", "in the space \"RAS\", whose vectors would be taken for left-posterior-superior ones"},
           {"right-anterior-superior", same, "in the space \"right-anterior-superior\""},
           {"RAS", turned, "in the space \"RAS\""},
           {"left-anterior-superior", "", "in the space \"left-anterior-superior\""}}) {
    const auto read = read_image(field("field.nrrd", space, frame), 3);
    EXPECT_EQ(read.has_value(), why.empty()) << space << ' ' << frame << (read ? "" : read.error().what);
    if (read) continue;
    EXPECT_NE(read.error().what.find("field.nrrd: "), std::string::npos) << read.error().what;
    EXPECT_NE(read.error().what.find(why), std::string::npos) << read.error().what;
  }
  // A CT has no vectors: its reader turns all that it says.
  EXPECT_TRUE(import_volume(fs::path(
      scratch.file("ct.nrrd", kNrrd + "space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,2)\nspace origin: (1,2,3)\n" +
                                  turned + "\n" + voxels({4, 3, 2})))));
}

TEST(StatedGeometry, LettersNameEachOfThe48AxesOnce) {
  int named = 0;
  const std::string all = "RLAPIS";
  for (const char i : all) {
    for (const char j : all) {
      for (const char k : all) {
        const std::string letters{i, j, k};
        const auto axes = axes_of_letters(letters);
        if (!axes) continue;
        ++named;
        Eigen::Affine3d turn = Eigen::Affine3d::Identity();
        turn.linear() = *axes;
        EXPECT_EQ(orientation_letters(turn), letters);
      }
    }
  }
  EXPECT_EQ(named, 48);
  for (const char* none : {"", "LP", "LPSS", "lps", "LRS", "LPX"}) EXPECT_FALSE(axes_of_letters(none)) << none;
}

/// A MetaImage of so many voxels a side, so far apart, with so many HU in each but the first, which has `first`.
std::string cube(int side, double apart_mm, std::int16_t hu, std::int16_t first) {
  std::string text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n";
  text += fmt::format(
      "DimSize = {0} {0} {0}\nElementType = MET_SHORT\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\n"
      "ElementSpacing = {1} {1} {1}\nElementDataFile = LOCAL\n",
      side, apart_mm);
  const std::size_t at = text.size();
  text.resize(at + 2 * grid_count({side, side, side}));
  for (std::size_t i = at; i < text.size(); i += sizeof hu) std::memcpy(text.data() + i, &hu, sizeof hu);
  std::memcpy(text.data() + at, &first, sizeof first);
  return text;
}

TEST(StatedGeometry, VoxelsAndBodiesThatNoCtHasAreRefused) {
  const Scratch scratch;
  const auto file = [&](const char* name, int side, double apart_mm, std::int16_t hu = 0, std::int16_t first = 1) {
    return fs::path(scratch.file(name, cube(side, apart_mm, hu, first)));
  };
  EXPECT_TRUE(import_volume(file("least.mha", 4, 0.02)));
  EXPECT_TRUE(import_volume(file("widest.mha", 4, 20)));
  std::string floats = nifti(1, 0, 0);
  for (const auto& [at, apart_mm] : {std::pair{80UL, 0.02F}, {84UL, 20.0F}, {88UL, 0.02F}})
    floats = with_number(floats, at, apart_mm);
  EXPECT_TRUE(import_volume(fs::path(scratch.file("floats.nii", floats)))) << "0.02 as a float is less than 0.02";
  expect_refused(import_volume(file("fine.mha", 4, 0.019)), "fine.mha", "metres");
  expect_refused(import_volume(file("coarse.mha", 4, 20.1)), "coarse.mha", "another unit");
  const auto body = [](const fs::path& path) -> Result<Volume> {
    auto read = import_body(path);
    if (!read) return read.error();
    return read->volume;
  };
  EXPECT_TRUE(body(file("small.mha", 21, 1)));
  EXPECT_TRUE(body(file("large.mha", 149, 20)));
  // A look at it is no registration.
  EXPECT_TRUE(import_volume(scratch.path() / "small.mha"));
  EXPECT_TRUE(import_volume(file("tiny.mha", 60, 0.3)));
  expect_refused(body(scratch.path() / "tiny.mha"), "tiny.mha", "a body of 18 mm");
  expect_refused(body(file("giant.mha", 151, 20)), "giant.mha", "a body of 3020 mm");
  expect_refused(body(file("air.mha", 60, 1, -1000, -1000)), "air.mha", "nothing but air");
  expect_refused(body(file("empty.mha", 60, 1, 40, 40)), "empty.mha", "all of its voxels are 40 HU");
}

}  // namespace
}  // namespace birdseye::host
