#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <numeric>

#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"
#include "host/volume/segmentation.hpp"
#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "tests/support/data.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::Scratch;

hw_sim::Grid grid() {
  hw_sim::Grid g;
  g.size = {6, 5, 4};
  g.origin_mm = {-20, 30, -100};
  g.spacing_mm = {1.5, 1.25, 2};
  return g;
}

std::vector<std::int16_t> values() {
  std::vector<std::int16_t> hu(grid().voxels());
  std::iota(hu.begin(), hu.end(), std::int16_t{-60});
  return hu;
}

void write_mha(const fs::path& path, const char* type, const void* data, std::size_t bytes,
               const char* matrix = "1 0 0 0 1 0 0 0 1") {
  std::ofstream out(path, std::ios::binary);
  out << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nTransformMatrix = "
      << matrix << "\nOffset = -20 30 -100\nElementSpacing = 1.5 1.25 2\nDimSize = 6 5 4\nElementType = " << type
      << "\nElementDataFile = LOCAL\n";
  out.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
}

void expect_the_grid(const Result<Volume>& volume) {
  ASSERT_TRUE(volume) << volume.error().what;
  EXPECT_EQ(volume->size, (std::array<int, 3>{6, 5, 4}));
  EXPECT_EQ(volume->hu, values());
  EXPECT_LT((volume->spacing_mm - Eigen::Vector3d(1.5, 1.25, 2)).norm(), 1e-5);
  EXPECT_LT((volume->patient_from_voxel * Eigen::Vector3d(5, 4, 3) - grid().last_mm()).norm(), 1e-4);
}

TEST(Import, EveryFormatGivesTheSameVolume) {
  const Scratch scratch;
  const auto hu = values();
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid(), hu, 1));
  expect_the_grid(import_volume(scratch / "ct"));
  write_mha(scratch / "a.mha", "MET_SHORT", hu.data(), hu.size() * 2);
  expect_the_grid(import_volume(scratch / "a.mha"));
  {
    std::ofstream out(scratch / "a.nrrd", std::ios::binary);
    out << "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 6 5 4\nspace directions: "
           "(1.5,0,0) "
           "(0,1.25,0) (0,0,2)\nendian: little\nencoding: raw\nspace origin: (-20,30,-100)\n\n";
    out.write(reinterpret_cast<const char*>(hu.data()), static_cast<std::streamsize>(hu.size() * 2));
  }
  expect_the_grid(import_volume(scratch / "a.nrrd"));
}

TEST(Import, ReadsNothingOnceItIsAskedToStop) {
  const Scratch scratch;
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid(), values(), 1));
  std::stop_source stop;
  expect_the_grid(import_volume(scratch / "ct", stop.get_token()));
  stop.request_stop();
  const auto stopped = import_volume(scratch / "ct", stop.get_token());
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::disconnected);
  EXPECT_NE(stopped.error().what.find("ct: was not read: cancelled"), std::string::npos) << stopped.error().what;
}

TEST(Import, SlicesAreStackedByPlaceNotByName) {
  const Scratch scratch;
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid(), values(), 1));
  fs::rename(scratch / "ct/0001.dcm", scratch / "ct/z.dcm");
  expect_the_grid(import_volume(scratch / "ct"));
}

void expect_refused(const fs::path& path, const std::string& why) {
  const auto volume = import_volume(path);
  ASSERT_FALSE(volume) << path;
  EXPECT_NE(volume.error().what.find(path.string()), std::string::npos) << volume.error().what;
  EXPECT_NE(volume.error().what.find(why), std::string::npos) << volume.error().what;
  EXPECT_EQ(volume.error().what.find('\n'), std::string::npos) << volume.error().what;
}

TEST(Import, RefusesWithAReason) {
  const Scratch scratch;
  expect_refused(scratch / "nothing", "no such file");
  fs::create_directory(scratch / "empty");
  expect_refused(scratch / "empty", "is empty");
  std::ofstream(scratch / "text.nii") << "not an image";
  expect_refused(scratch / "text.nii", "no image");

  std::vector<float> voxels(grid().voxels(), 10.0F);
  voxels[7] = NAN;
  {
    std::array<char, 352> header{};
    const auto put = [&header](std::size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof value); };
    put(0, std::int32_t{348});
    for (std::size_t i = 0; i < 4; ++i) put(40 + 2 * i, std::int16_t{std::array<std::int16_t, 4>{3, 6, 5, 4}[i]});
    put(70, std::int16_t{16});
    put(72, std::int16_t{32});
    for (std::size_t i = 0; i < 4; ++i) put(76 + 4 * i, 1.0F);
    put(108, 352.0F);
    put(252, std::int16_t{1});
    std::memcpy(header.data() + 344, "n+1", 4);
    std::ofstream out(scratch / "nan.nii", std::ios::binary);
    out.write(header.data(), static_cast<std::streamsize>(header.size()));
    out.write(reinterpret_cast<const char*>(voxels.data()), static_cast<std::streamsize>(voxels.size() * 4));
  }
  expect_refused(scratch / "nan.nii", "not finite");
  {
    std::fstream file(scratch / "nan.nii", std::ios::binary | std::ios::in | std::ios::out);
    const float nan = NAN;
    file.seekp(112);  // the slope of its values
    file.write(reinterpret_cast<const char*>(&nan), sizeof nan);
  }
  expect_refused(scratch / "nan.nii", "header that are not finite");
  {
    // What the reader leaves as it was must not be taken for voxels.
    std::ofstream out(scratch / "garbled.mha", std::ios::binary);
    out << "ObjectType = Image\nNDims = 3\nBinaryData = True\nCompressedData = True\nCompressedDataSize = 9\n"
           "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementSpacing = 1 1 1\nDimSize = 6 5 4\nElementType = "
           "MET_SHORT\nElementDataFile = LOCAL\nno stream";
    std::ofstream(scratch / "list.mhd") << "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 1 1 1\n"
                                           "TransformMatrix = 1 0 0 0 1 0 0 0 1\n"
                                           "DimSize = 6 5 2\nElementType = MET_SHORT\nElementDataFile = LIST\n"
                                           "nowhere1.raw\nnowhere2.raw\n";
  }
  expect_refused(scratch / "garbled.mha", "damaged");
  expect_refused(scratch / "list.mhd", "\"nowhere1.raw\" is not there");
  write_mha(scratch / "nan.mha", "MET_FLOAT", voxels.data(), voxels.size() * 4);
  expect_refused(scratch / "nan.mha", "not finite");
  voxels[7] = 1e6F;
  write_mha(scratch / "big.mha", "MET_FLOAT", voxels.data(), voxels.size() * 4);
  expect_refused(scratch / "big.mha", "no Hounsfield unit");
  write_mha(scratch / "cut.mha", "MET_SHORT", voxels.data(), 20);
  expect_refused(scratch / "cut.mha", "damaged");
  const std::vector<std::uint8_t> labels(grid().voxels(), 3);
  ASSERT_TRUE(hw_sim::write_labels(scratch / "cut.nii", grid(), labels));
  fs::resize_file(scratch / "cut.nii", fs::file_size(scratch / "cut.nii") - 30);
  expect_refused(scratch / "cut.nii", "damaged");
  ASSERT_TRUE(hw_sim::write_labels(scratch / "cut.nii.gz", grid(), labels));
  fs::resize_file(scratch / "cut.nii.gz", fs::file_size(scratch / "cut.nii.gz") - 12);
  expect_refused(scratch / "cut.nii.gz", "damaged");
  {
    std::ofstream out(scratch / "cut.nrrd", std::ios::binary);
    out << "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 6 5 4\nspace directions: "
           "(1,0,0) "
           "(0,1,0) (0,0,1)\nendian: little\nencoding: raw\nspace origin: (0,0,0)\n\nshort";
  }
  expect_refused(scratch / "cut.nrrd", "damaged");
}

TEST(Import, RefusesFoldersThatAreNoStack) {
  const Scratch scratch;
  const auto make = [&](const char* name, std::uint64_t seed) {
    ASSERT_TRUE(hw_sim::write_dicom_series(scratch / name, grid(), values(), seed));
  };
  make("a", 1);
  make("b", 2);
  fs::copy_file(scratch / "b/0001.dcm", scratch / "a/other.dcm");
  fs::copy_file(scratch / "b/0002.dcm", scratch / "a/another.dcm");
  expect_refused(scratch / "a", "2 series");
  make("missing", 1);
  fs::remove(scratch / "missing/0002.dcm");
  expect_refused(scratch / "missing", "missing or unevenly spaced");
  make("doubled", 1);
  fs::copy_file(scratch / "doubled/0002.dcm", scratch / "doubled/again.dcm");
  {
    std::fstream again(scratch / "doubled/again.dcm", std::ios::binary | std::ios::in | std::ios::out);
    again.seekp(-1, std::ios::end);
    again.put('\x01');  // of a pixel: not the same file twice
  }
  expect_refused(scratch / "doubled", "same place");
}

TEST(Import, SlicesThatEndEarlyAreNamedAndNothingDies) {
  const Scratch scratch;
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid(), values(), 1));
  for (const char* name : {"0001.dcm", "0004.dcm"}) {
    const fs::path slice = scratch / "ct" / name;
    fs::copy_file(slice, scratch / "whole");
    const auto whole = fs::file_size(slice);
    for (std::uintmax_t bytes = 0; bytes < whole; bytes += 37) {
      fs::resize_file(slice, bytes);
      const auto volume = import_volume(scratch / "ct");
      ASSERT_FALSE(volume) << name << " cut to " << bytes << " of " << whole;
      EXPECT_NE(volume.error().what.find(name), std::string::npos) << volume.error().what;
      EXPECT_EQ(volume.error().what.find('\n'), std::string::npos) << volume.error().what;
      fs::copy_file(scratch / "whole", slice, fs::copy_options::overwrite_existing);
    }
    fs::remove(scratch / "whole");
  }
  expect_the_grid(import_volume(scratch / "ct"));
}

TEST(Import, StrangersInASeriesAreNamedBystandersAreNot) {
  const Scratch scratch;
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid(), values(), 1));
  std::ofstream(scratch / "ct/README.txt") << "of the ward";
  std::ofstream(scratch / "ct/.hidden") << "of the disk";
  expect_the_grid(import_volume(scratch / "ct"));
  std::ofstream(scratch / "ct/IM0007") << "what was a slice";
  expect_refused(scratch / "ct/IM0007", "no image that can be read");
  const auto volume = import_volume(scratch / "ct");
  ASSERT_FALSE(volume);
  EXPECT_NE(volume.error().what.find("IM0007"), std::string::npos) << volume.error().what;
}

TEST(Import, ASmallTiltOfATallStackIsRefused) {
  // Half a degree: each step is 17 um aside, less than a series is written to; sixty of them are 1 mm.
  const Scratch scratch;
  hw_sim::Grid tall = grid();
  tall.size = {6, 5, 60};
  const std::vector<std::int16_t> hu(tall.voxels(), 40);
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", tall, hu, 1));
  ASSERT_TRUE(import_volume(scratch / "ct"));
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "tilted", tall, hu, 1, 0.5));
  expect_refused(scratch / "tilted", "tilted by 0.5 degrees");
}

TEST(Labels, AreOfTheSameGridOrRefused) {
  const Scratch scratch;
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid(), values(), 1));
  const auto ct = import_volume(scratch / "ct");
  ASSERT_TRUE(ct);
  const std::vector<std::uint8_t> labels(grid().voxels(), 3);
  ASSERT_TRUE(hw_sim::write_labels(scratch / "same.nii.gz", grid(), labels));
  EXPECT_TRUE(import_labels(scratch / "same.nii.gz", *ct));
  hw_sim::Grid other = grid();
  other.origin_mm.x() += 0.5;
  ASSERT_TRUE(hw_sim::write_labels(scratch / "moved.nii.gz", other, labels));
  EXPECT_FALSE(import_labels(scratch / "moved.nii.gz", *ct));
  other = grid();
  other.spacing_mm.z() += 0.15;
  ASSERT_TRUE(hw_sim::write_labels(scratch / "stretched.nii.gz", other, labels));
  EXPECT_FALSE(import_labels(scratch / "stretched.nii.gz", *ct));
}

TEST(Import, TheAbdomenIsAsItsReadmeSays) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto nifti = import_volume(*data / "ct_abdomen/example_ct.nii.gz");
  ASSERT_TRUE(nifti) << nifti.error().what;
  EXPECT_EQ(nifti->size, (std::array<int, 3>{122, 101, 112}));
  // The file's frame is RAS, diag(3, 3, 3) from (-177.956, 11.319, 94.302).
  EXPECT_LT((nifti->patient_from_voxel * Eigen::Vector3d(0, 0, 0) - Eigen::Vector3d(177.956, -11.319, 94.302)).norm(),
            2e-3);
  EXPECT_LT((nifti->patient_from_voxel * Eigen::Vector3d(1, 1, 1) - Eigen::Vector3d(174.956, -14.319, 97.302)).norm(),
            2e-3);
  EXPECT_EQ(*std::min_element(nifti->hu.begin(), nifti->hu.end()), -1207);
  EXPECT_EQ(*std::max_element(nifti->hu.begin(), nifti->hu.end()), 3382);
  EXPECT_EQ(orientation_letters(nifti->patient_from_voxel), "RAS");

  const auto dicom = import_volume(*data / "ct_abdomen/example_ct_dicom");
  ASSERT_TRUE(dicom) << dicom.error().what;
  EXPECT_EQ(dicom->size, (std::array<int, 3>{512, 512, 20}));
  EXPECT_NEAR(dicom->spacing_mm.z(), 2, 1e-6);
  EXPECT_LT((dicom->patient_from_voxel.translation() - Eigen::Vector3d(-249.512, -437.512, -804.5)).norm(), 1e-3);
}

TEST(Import, TheLiverOfTheAbdomenHasItsPublishedDensity) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto ct = import_volume(*data / "ct_abdomen/example_ct_sm.nii.gz");
  const auto labels = import_labels(*data / "ct_abdomen/example_seg.nii.gz", *ct);
  ASSERT_TRUE(labels) << labels.error().what;
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < ct->hu.size(); ++i) {
    if (labels->hu[i] != 5) continue;
    sum += ct->hu[i];
    ++count;
  }
  EXPECT_EQ(count, 38634);
  EXPECT_NEAR(sum / count, 45.3, 0.05);
  // Orientation: the liver lies to the patient's right of the spleen, in LPS at smaller x.
  EXPECT_LT(label_centroid_mm(*labels, 5)->x(), label_centroid_mm(*labels, 1)->x());
  // And the kidney labelled right to the right of the one labelled left.
  EXPECT_LT(label_centroid_mm(*labels, 2)->x(), label_centroid_mm(*labels, 3)->x());
}

TEST(Import, TheLabelsOfTheDicomFolderLieOnItsGrid) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  // The labels' own file has its axes the other way round: same places, other order of voxels.
  const auto ct = import_volume(*data / "ct_abdomen/example_ct_dicom");
  const auto labels = import_volume(*data / "ct_abdomen/example_seg_dicom.nii.gz");
  ASSERT_TRUE(labels) << labels.error().what;
  const Eigen::Affine3d ct_from_labels = ct->patient_from_voxel.inverse() * labels->patient_from_voxel;
  double sum = 0;
  int count = 0;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 512; ++j) {
      for (int i = 0; i < 512; ++i) {
        if (labels->at(i, j, k) != 5) continue;
        const Eigen::Vector3d v = ct_from_labels * Eigen::Vector3d(i, j, k);
        sum += ct->at(static_cast<int>(std::lround(v.x())), static_cast<int>(std::lround(v.y())),
                      static_cast<int>(std::lround(v.z())));
        ++count;
      }
    }
  }
  EXPECT_NEAR(count * 0.9765625 * 0.9765625 * 2 / 1000, 699.4, 1.0);
  EXPECT_GT(sum / count, 30);
  EXPECT_LT(sum / count, 200);
}

TEST(Import, OdditiesDecodeOrAreRefused) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const fs::path folder = *data / "ct_dicom_oddities";
  const auto j2k = import_volume(folder / "J2K_pixelrep_mismatch.dcm");
  ASSERT_TRUE(j2k) << j2k.error().what;
  EXPECT_EQ(j2k->at(0, 0, 0), -2000);
  const std::int16_t down[] = {621, 412, 138, -193, -520, -767, -907, -966, -988, -995};
  const std::int16_t up[] = {-377, -121, 141, 383, 633, 910, 1198, 1455, 1638, 1732};
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(j2k->at(279, 47 + i, 0), down[i]);
    EXPECT_EQ(j2k->at(106, 328 + i, 0), up[i]);
  }
  const auto pelvis = import_volume(folder / "pelvis_rescale10_55332681.dcm");
  ASSERT_TRUE(pelvis) << pelvis.error().what;
  EXPECT_NEAR(pelvis->at(256, 20, 0), 920 * 10 - 10240, 60);
  EXPECT_EQ(pelvis->at(256, 20, 0) % 10, 0);
  for (const char* name : {"CT_small.dcm", "bad_sequence.dcm", "explicit_VR-UN.dcm"}) {
    const auto slice = import_volume(folder / name);
    ASSERT_TRUE(slice) << slice.error().what;
    const auto [low, high] = std::minmax_element(slice->hu.begin(), slice->hu.end());
    EXPECT_GE(*low, -1100) << name;
    EXPECT_GT(*high, 200) << name;
    EXPECT_LT(*high, 3100) << name;
  }
  expect_refused(*data / "ct_gantry_tilt", "tilted by 18.5 degrees");

  const Scratch scratch;
  const std::string unpack =
      "cd " + scratch.path().string() + " && cmake -E tar xf " + (folder / "dupe-positions.zip").string();
  ASSERT_EQ(std::system(unpack.c_str()), 0);
  fs::path slices;
  for (const auto& entry : fs::recursive_directory_iterator(scratch.path())) {
    if (entry.path().extension() == ".dcm") slices = entry.path().parent_path();
  }
  const auto doubled = import_volume(slices);
  ASSERT_FALSE(doubled);
  EXPECT_EQ(doubled.error().code, Errc::unsupported);
}

TEST(Segmentation, ByRangeSeedAndSize) {
  const Scratch scratch;
  Volume ct;
  ct.size = {12, 10, 8};
  ct.spacing_mm = {2, 2, 3};
  ct.patient_from_voxel.linear() = ct.spacing_mm.asDiagonal();
  ct.patient_from_voxel.translation() = Eigen::Vector3d(-10, 5, 40);
  ct.hu.assign(12 * 10 * 8, -100);
  const auto fill = [&ct](int i0, int i1, std::int16_t hu) {
    for (int k = 2; k < 5; ++k) {
      for (int j = 2; j < 5; ++j) {
        for (int i = i0; i < i1; ++i) ct.hu[ct.index(i, j, k)] = hu;
      }
    }
  };
  fill(1, 4, 60);   // 27 voxels
  fill(6, 11, 80);  // 45 voxels
  const auto count = [](const Result<Volume>& labels) {
    EXPECT_TRUE(labels) << labels.error().what;
    return std::count(labels->hu.begin(), labels->hu.end(), std::int16_t{1});
  };
  SegmentationSettings settings;
  settings.low_hu = 50;
  settings.high_hu = 90;
  EXPECT_EQ(count(segment(ct, settings)), 72);
  settings.largest = true;
  EXPECT_EQ(count(segment(ct, settings)), 45);
  settings.largest = false;
  settings.seed_in_patient_mm = ct.patient_from_voxel * Eigen::Vector3d(2, 3, 3);
  const auto seeded = segment(ct, settings);
  EXPECT_EQ(count(seeded), 27);
  ASSERT_TRUE(write_labels(scratch / "organ.nii.gz", *seeded));
  const auto back = import_labels(scratch / "organ.nii.gz", ct);
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(back->hu, seeded->hu);

  settings.seed_in_patient_mm = Eigen::Vector3d(1000, 0, 0);
  EXPECT_NE(segment(ct, settings).error().what.find("outside of the volume"), std::string::npos);
  settings.seed_in_patient_mm = ct.patient_from_voxel * Eigen::Vector3d(0, 0, 0);
  EXPECT_NE(segment(ct, settings).error().what.find("-100 HU"), std::string::npos);
  settings.seed_in_patient_mm.reset();
  settings.low_hu = 500;
  settings.high_hu = 600;
  EXPECT_EQ(segment(ct, settings).error().code, Errc::not_found);
  settings.high_hu = 400;
  EXPECT_EQ(segment(ct, settings).error().code, Errc::bad_value);
}

TEST(Labels, KeepTheirVoxelsAndASoftEdge) {
  Volume ct;
  ct.size = {9, 9, 9};
  ct.spacing_mm = {2, 2, 2};
  ct.patient_from_voxel.linear() *= 2;
  ct.hu.assign(729, 100);
  Volume labels = ct;
  std::fill(labels.hu.begin(), labels.hu.end(), std::int16_t{0});
  labels.hu[labels.index(5, 4, 4)] = 4;
  labels.hu[labels.index(0, 0, 0)] = 3;
  const int values[] = {4};
  const auto result = keep_labels(ct, labels, values);
  ASSERT_TRUE(result);
  const Volume& kept = *result;
  EXPECT_EQ(kept.size, (std::array<int, 3>{5, 5, 5}));
  EXPECT_EQ(kept.patient_from_voxel * Eigen::Vector3d(2, 2, 2), Eigen::Vector3d(10, 8, 8));
  EXPECT_EQ(kept.at(2, 2, 2), 100);
  EXPECT_EQ(kept.at(1, 1, 1), 100);
  EXPECT_EQ(kept.at(0, 0, 0), -1024);
  EXPECT_EQ(std::count(kept.hu.begin(), kept.hu.end(), 100), 27);
  EXPECT_EQ(*label_centroid_mm(labels, 4), Eigen::Vector3d(10, 8, 8));
  EXPECT_FALSE(label_centroid_mm(labels, 9));
  const int absent[] = {9, 12};
  const std::string refused = keep_labels(ct, labels, absent).error().what;
  EXPECT_NE(refused.find("no voxel of 9, 12: those there are 3, 4"), std::string::npos) << refused;
}

}  // namespace
}  // namespace birdseye::host
