#include "host/volume/stated_geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

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
  for (const auto& [name, header, lacks] : std::vector<std::array<std::string, 3>>{
           {"a.nrrd", kNrrd + "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n\n", ""},
           {"b.nrrd", kNrrd + "space: RAS\r\nspace directions: (1,0,0) (0,1,0) (0,0,2)\r\n\r\n", ""},
           {"c.nrrd", kNrrd + "space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n\n", "\"space\""},
           {"d.nrrd", kNrrd + "spacings: 1 1 2\n\n", "\"space\""},
           {"e.nrrd", kNrrd + "space: scanner-xyz\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n\n", "scanner-xyz"},
           {"f.nrrd", kNrrd + "space: LPS\nspacings: 1 1 2\n\n", "space directions"},
           {"g.mha", kMeta + "ElementSpacing = 1 1 2\nElementDataFile = LOCAL\n", ""},
           {"h.mha", kMeta + "ElementDataFile = LOCAL\nElementSpacing = 1 1 2\n", "ElementSpacing"},
           {"i.mhd", "NDims = -1e308\nElementSpacing = 1 1 2\nElementDataFile = i.raw\n", "NDims"},
           {"j.nii", "anything", ""}}) {
    const std::string told = unstated_geometry(scratch.file(name, header));
    EXPECT_EQ(told.empty(), lacks.empty()) << name << ": " << told;
    EXPECT_NE(told.find(lacks), std::string::npos) << name << ": " << told;
  }
}

/// A NIfTI-1 file of 4 x 3 x 2 voxels: the codes of its two geometries, and by how much they lie apart along x.
std::string nifti(std::int16_t quaternion, std::int16_t matrix, float apart_mm) {
  std::string file(352 + 48, '\0');
  const auto put = [&file](std::size_t at, auto value) { std::memcpy(file.data() + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  for (int axis = 0; axis < 8; ++axis)
    put(40 + 2 * static_cast<std::size_t>(axis),
        std::array<std::int16_t, 8>{3, 4, 3, 2, 1, 1, 1, 1}[static_cast<std::size_t>(axis)]);
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
    put(280 + 20 * k, 1.0F);
    put(292 + 16 * k, k == 0 ? 10.0F + apart_mm : 10.0F);
  }
  std::memcpy(file.data() + 344, "n+1", 4);
  return file;
}

TEST(StatedGeometry, ANiftiFileSaysOnePlaceForItsVoxels) {
  const Scratch scratch;
  EXPECT_TRUE(import_volume(fs::path(scratch.file("both.nii", nifti(1, 1, 0.0F)))));
  EXPECT_TRUE(import_volume(fs::path(scratch.file("by_matrix.nii", nifti(0, 2, 30.0F)))));
  EXPECT_TRUE(import_volume(fs::path(scratch.file("by_quaternion.nii", nifti(1, 0, 30.0F)))));
  EXPECT_TRUE(import_volume(fs::path(scratch.file("rounded.nii", nifti(1, 1, 0.01F)))));
  for (const auto& [name, text, why] :
       std::vector<std::array<std::string, 3>>{{"none.nii", nifti(0, 0, 0.0F), "neither its qform nor its sform"},
                                               {"two.nii", nifti(1, 1, 12.0F), "12.0 mm apart"},
                                               {"far.nii", nifti(1, 1, 3.4e38F), "header"}}) {
    const auto read = import_volume(fs::path(scratch.file(name, text)));
    ASSERT_FALSE(read) << name;
    EXPECT_NE(read.error().what.find(name), std::string::npos) << read.error().what;
    EXPECT_NE(read.error().what.find(why), std::string::npos) << read.error().what;
  }
}

}  // namespace
}  // namespace birdseye::host
