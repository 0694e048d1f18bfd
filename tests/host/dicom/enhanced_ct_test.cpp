#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/volume/import.hpp"
#include "host/volume/series_list.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::CtFrame;
using testing::put;
using testing::Scratch;

/// Frames every 2 mm, whose HU begin at 100 k, though each is stored with a scale of its own.
std::vector<CtFrame> even_frames(int count) {
  std::vector<CtFrame> frames;
  for (int k = 0; k < count; ++k) {
    const double intercept = -1000 - 10 * k;
    frames.push_back({{3, 4, 2.0 * k}, 100 * k - static_cast<int>(intercept), intercept, 1, 1});
  }
  return frames;
}

void expect_frames(const VolumeSource& source, int count) {
  const auto ct = import_volume(source);
  ASSERT_TRUE(ct) << ct.error().what;
  EXPECT_EQ(ct->size, (std::array<int, 3>{4, 3, count}));
  EXPECT_TRUE(ct->spacing_mm.isApprox(Eigen::Vector3d(0.5, 0.75, 2)));
  EXPECT_TRUE((ct->patient_from_voxel * Eigen::Vector3d(1, 1, 1)).isApprox(Eigen::Vector3d(3.5, 4.75, 2)));
  for (int k = 0; k < count; ++k) {
    EXPECT_EQ(ct->at(0, 0, k), 100 * k) << k;
    EXPECT_EQ(ct->at(3, 2, k), 100 * k + 11) << k;
  }
}

void expect_refusal(const fs::path& path, const std::string& why) {
  const auto ct = import_volume(path);
  ASSERT_FALSE(ct) << "read, where it should say: " << why;
  EXPECT_NE(ct.error().what.find(why), std::string::npos) << ct.error().what;
}

TEST(EnhancedCt, FramesInAnyOrderEachWithItsOwnScale) {
  const Scratch scratch;
  auto frames = even_frames(9);
  testing::write_enhanced_ct(scratch / "a.dcm", frames);
  expect_frames(scratch / "a.dcm", 9);
  std::mt19937 random(7);
  for (int i = 0; i < 5; ++i) {
    std::shuffle(frames.begin(), frames.end(), random);
    testing::write_enhanced_ct(scratch / "b/shuffled.dcm", frames);
    expect_frames(scratch / "b", 9);
  }
  testing::write_enhanced_ct(scratch / "rle.dcm", frames, {}, EXS_RLELossless);
  expect_frames(scratch / "rle.dcm", 9);
  testing::write_enhanced_ct(scratch / "deflated.dcm", frames, {}, EXS_DeflatedLittleEndianExplicit);
  expect_frames(scratch / "deflated.dcm", 9);
}

TEST(EnhancedCt, ASeriesMayLieInSeveralFiles) {
  const Scratch scratch;
  const auto frames = even_frames(9);
  testing::write_enhanced_ct(scratch / "ct/2", {frames.begin() + 4, frames.end()});
  testing::write_enhanced_ct(scratch / "ct/1", {frames.begin(), frames.begin() + 4});
  expect_frames(scratch / "ct", 9);
}

TEST(EnhancedCt, ScaleAndPlaceMayBeSharedOrTheFiles) {
  const Scratch scratch;
  auto frames = even_frames(3);
  for (CtFrame& frame : frames) frame.first += static_cast<int>(frame.intercept) + 1024;
  testing::write_enhanced_ct(scratch / "a.dcm", frames, [](DcmDataset& dataset) {
    DcmSequenceOfItems* groups = nullptr;
    ASSERT_TRUE(dataset.findAndGetSequence(DCM_PerFrameFunctionalGroupsSequence, groups).good());
    for (unsigned long i = 0; i < groups->card(); ++i)
      groups->getItem(i)->findAndDeleteElement(DCM_PixelValueTransformationSequence);
    DcmItem* shared = nullptr;
    ASSERT_TRUE(dataset.findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, shared).good());
    DcmItem& scale = testing::add_item(*shared, DCM_PixelValueTransformationSequence);
    put(scale, DCM_RescaleIntercept, "-1024");
    put(scale, DCM_RescaleSlope, "1");
  });
  expect_frames(scratch / "a.dcm", 3);
}

TEST(EnhancedCt, IsJudgedAsSlicesOfTheirOwnFilesAre) {
  const Scratch scratch;
  auto frames = even_frames(9);
  frames.erase(frames.begin() + 4);
  testing::write_enhanced_ct(scratch / "gap.dcm", frames);
  expect_refusal(scratch / "gap.dcm", "missing or unevenly spaced");
  expect_refusal(scratch / "gap.dcm", "frame 4 of gap.dcm");
  frames = even_frames(9);
  for (CtFrame& frame : frames) frame.place_mm.y() += frame.place_mm.z() * std::tan(0.2);
  testing::write_enhanced_ct(scratch / "tilt.dcm", frames);
  expect_refusal(scratch / "tilt.dcm", "tilted by 11.5 degrees");
  expect_refusal(scratch / "tilt.dcm", "--untilt");
  frames = even_frames(9);
  frames.push_back(frames[3]);
  testing::write_enhanced_ct(scratch / "twice.dcm", frames);
  expect_refusal(scratch / "twice.dcm", "same place");
}

TEST(EnhancedCt, PhasesAreToldApartByTheirTemporalPosition) {
  const Scratch scratch;
  auto frames = even_frames(5);
  for (CtFrame frame : even_frames(5)) {
    frame.temporal = 2;
    frame.first += 500;
    frames.push_back(frame);
  }
  testing::write_enhanced_ct(scratch / "ct.dcm", frames);
  VolumeSource source(scratch / "ct.dcm");
  expect_refusal(source.path, "holds 2 volumes");
  source.series = "temporal position 1";
  expect_frames(source, 5);
  source.series = "5.2";
  const auto second = import_volume(source);
  ASSERT_TRUE(second) << second.error().what;
  EXPECT_EQ(second->at(0, 0, 2), 700);
}

TEST(EnhancedCt, ClaimsThatDoNotFitAreRefused) {
  const Scratch scratch;
  const auto frames = even_frames(4);
  const auto claim = [](const char* count) {
    return [count](DcmDataset& dataset) { put(dataset, DCM_NumberOfFrames, count); };
  };
  testing::write_enhanced_ct(scratch / "more.dcm", frames, claim("70000"));
  expect_refusal(scratch / "more.dcm", "says it has 70000 frames, and has the places of 4");
  testing::write_enhanced_ct(scratch / "less.dcm", frames, claim("3"));
  expect_refusal(scratch / "less.dcm", "says it has 3 frames, and has the places of 4");
  testing::write_enhanced_ct(scratch / "none.dcm", frames, claim("-4"));
  expect_refusal(scratch / "none.dcm", "number of frames");
  testing::write_enhanced_ct(scratch / "short.dcm", frames, [](DcmDataset& dataset) {
    const std::vector<Uint16> few(20, 0);
    ASSERT_TRUE(dataset.putAndInsertUint16Array(DCM_PixelData, few.data(), few.size()).good());
  });
  expect_refusal(scratch / "short.dcm", "cut short");
  testing::write_enhanced_ct(scratch / "placeless.dcm", frames, [](DcmDataset& dataset) {
    DcmItem* third = nullptr;
    ASSERT_TRUE(dataset.findAndGetSequenceItem(DCM_PerFrameFunctionalGroupsSequence, third, 2).good());
    third->findAndDeleteElement(DCM_PlanePositionSequence);
  });
  expect_refusal(scratch / "placeless.dcm", "frame 3 has no sound Image Position");
}

TEST(EnhancedCt, CutAnywhereItIsAnErrorOfOneLine) {
  const Scratch scratch;
  testing::write_enhanced_ct(scratch / "ct.dcm", even_frames(4), {}, EXS_RLELossless);
  const auto whole = fs::file_size(scratch / "ct.dcm");
  for (std::uintmax_t bytes = 0; bytes < whole; bytes += 61) {
    fs::copy_file(scratch / "ct.dcm", scratch / "cut.dcm", fs::copy_options::overwrite_existing);
    fs::resize_file(scratch / "cut.dcm", bytes);
    const auto ct = import_volume(scratch / "cut.dcm");
    ASSERT_FALSE(ct) << "cut to " << bytes << " of " << whole;
    EXPECT_NE(ct.error().what.find("cut.dcm"), std::string::npos) << ct.error().what;
    EXPECT_EQ(ct.error().what.find('\n'), std::string::npos) << ct.error().what;
  }
}

/// What one voxel is, by a plane that rises in all directions: linear interpolation gives it back exactly.
double rising(const Eigen::Vector3d& p) {
  return 10 * p.x() + 20 * p.y() + 5 * p.z();
}

TEST(Untilt, GivesBackWhatLiesWhere) {
  const Scratch scratch;
  constexpr int kSize = 24;
  for (int k = 0; k < 12; ++k) {
    testing::CtSlice slice;
    slice.instance = k + 1;
    slice.place_mm = {-5, 3 - 0.37 * k, 2.0 * k};
    testing::write_ct_slice(scratch / "ct" / fmt::format("{}.dcm", k), slice, [&](DcmDataset& dataset) {
      std::vector<Uint16> pixels;
      for (int j = 0; j < kSize; ++j) {
        for (int i = 0; i < kSize; ++i) {
          const double hu = rising(slice.place_mm + Eigen::Vector3d(0.5 * i, 0.75 * j, 0));
          pixels.push_back(static_cast<Uint16>(std::lround(hu + 1000)));
        }
      }
      testing::put_pixels(dataset, kSize, kSize, pixels);
    });
  }
  VolumeSource source(scratch / "ct");
  expect_refusal(source.path, "--untilt");
  source.untilt = true;
  const auto read = import_with_notes(source);
  ASSERT_TRUE(read) << read.error().what;
  const Volume& ct = read->volume;
  EXPECT_EQ(ct.size, (std::array<int, 3>{kSize, kSize + 6, 12}));
  EXPECT_NEAR((ct.patient_from_voxel * Eigen::Vector3d::Zero()).y(), 3 - 0.37 * 11, 1e-6);
  int inside = 0;
  for (int k = 0; k < 12; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i) {
        const Eigen::Vector3d p = ct.patient_from_voxel * Eigen::Vector3d(i, j, k);
        const double row = (p.y() - (3 - 0.37 * k)) / 0.75;
        if (row >= 0 && row <= kSize - 1) {
          ++inside;
          EXPECT_NEAR(ct.at(i, j, k), rising(p), 1.01) << i << " " << j << " " << k;
        } else if (row <= -1 || row >= kSize) {
          EXPECT_EQ(ct.at(i, j, k), -1024);
        }
      }
    }
  }
  EXPECT_GT(inside, 12 * kSize * (kSize - 2));
  ASSERT_FALSE(read->notes.empty());
  // 0.37 mm is 0.493 of a pixel: of the shares s that follow, sqrt(mean of s (1 - s)) is 0.30 mm.
  double sum = 0;
  for (int k = 0; k < 12; ++k) {
    const double shift = 0.37 * (11 - k) / 0.75, s = shift - std::floor(shift);
    sum += s * (1 - s) * 0.75 * 0.75 / 12;
  }
  EXPECT_NE(read->notes.back().find(fmt::format("{:.2f} mm (standard", std::sqrt(sum))), std::string::npos)
      << read->notes.back();
  EXPECT_NE(read->notes.back().find("untilted by 10.5 degrees"), std::string::npos) << read->notes.back();
}

TEST(Untilt, BlursAnEdgeAsItSays) {
  // Half a pixel aside, a step of one pixel becomes one of two: its derivative spreads by half a pixel.
  const Scratch scratch;
  for (int k = 0; k < 2; ++k) {
    testing::CtSlice slice;
    slice.instance = k + 1;
    slice.place_mm = {0.25 * k, 0, 2.0 * k};
    testing::write_ct_slice(scratch / "ct" / fmt::format("{}.dcm", k), slice, [](DcmDataset& dataset) {
      testing::put_pixels(dataset, 4, 1, {1000, 1000, 2000, 2000});
    });
  }
  VolumeSource source(scratch / "ct");
  source.untilt = true;
  const auto read = import_with_notes(source);
  ASSERT_TRUE(read) << read.error().what;
  const Volume& ct = read->volume;
  EXPECT_EQ(ct.size, (std::array<int, 3>{5, 1, 2}));
  EXPECT_EQ(ct.at(1, 0, 0), 0);
  EXPECT_EQ(ct.at(2, 0, 0), 1000);
  EXPECT_EQ(ct.at(1, 0, 1), 0);
  EXPECT_EQ(ct.at(2, 0, 1), 500);
  EXPECT_EQ(ct.at(3, 0, 1), 1000);
  EXPECT_NE(read->notes.back().find("0.25 mm in the worst slice"), std::string::npos) << read->notes.back();
}

/// Tilted slices that show a plane which rises in all directions, at these places along z and as thick as this.
void write_tilted(const fs::path& folder, const std::vector<double>& places_mm, const std::vector<const char*>& thick) {
  constexpr int kSize = 24;
  for (std::size_t k = 0; k < places_mm.size(); ++k) {
    testing::CtSlice slice;
    slice.instance = static_cast<int>(k) + 1;
    slice.place_mm = {-5, -0.2 * places_mm[k], places_mm[k]};
    testing::write_ct_slice(folder / fmt::format("{}.dcm", k), slice, [&](DcmDataset& dataset) {
      put(dataset, DCM_SliceThickness, thick[k]);
      std::vector<Uint16> pixels;
      for (int i = 0; i < kSize * kSize; ++i) {
        const Eigen::Vector3d p = slice.place_mm + Eigen::Vector3d(0.5 * (i % kSize), 0.75 * (i / kSize), 0);
        pixels.push_back(static_cast<Uint16>(std::lround(rising(p) + 1000)));
      }
      testing::put_pixels(dataset, kSize, kSize, pixels);
    });
  }
}

TEST(Untilt, EvensOutStepsThatLeaveNoHole) {
  const Scratch scratch;
  write_tilted(scratch / "ct", {0, 2, 4, 6, 7, 10.5, 14}, {"2", "2", "2", "2", "3.5", "3.5", "3.5"});
  VolumeSource source(scratch / "ct");
  source.untilt = true;
  const auto read = import_with_notes(source);
  ASSERT_TRUE(read) << read.error().what;
  const Volume& ct = read->volume;
  EXPECT_EQ(ct.size[2], 8);
  EXPECT_NEAR(ct.spacing_mm.z(), 2, 1e-6);
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d p = ct.patient_from_voxel * Eigen::Vector3d(10, 12, k);
    EXPECT_NEAR(p.z(), 2 * k, 1e-9);
    EXPECT_NEAR(ct.at(10, 12, k), rising(p), 1.6) << k;
  }
  EXPECT_NE(read->notes.back().find("interpolated to 2.00 mm"), std::string::npos) << read->notes.back();
  // At 12 mm, between 10.5 and 14: 3.5 sqrt(0.43 0.57); at 8, between 7 and 10.5, 3.5 sqrt(0.29 0.71).
  EXPECT_NE(read->notes.back().find("1.73 mm in the worst"), std::string::npos) << read->notes.back();

  write_tilted(scratch / "hole", {0, 2, 4, 6, 10, 12, 14}, {"2", "2", "2", "2", "2", "2", "2"});
  source.path = scratch / "hole";
  const auto hole = import_volume(source);
  ASSERT_FALSE(hole);
  EXPECT_NE(hole.error().what.find("missing or unevenly spaced"), std::string::npos) << hole.error().what;
}

TEST(Untilt, IsNoRemedyForSlicesThatAreShiftedUnevenly) {
  const Scratch scratch;
  for (int k = 0; k < 5; ++k) {
    testing::CtSlice slice;
    slice.instance = k + 1;
    slice.place_mm = {k == 2 ? 10.0 : 0.0, 0, 2.0 * k};
    testing::write_ct_slice(scratch / "ct" / fmt::format("{}.dcm", k), slice);
  }
  VolumeSource source(scratch / "ct");
  for (const bool untilt : {false, true}) {
    source.untilt = untilt;
    const auto read = import_volume(source);
    ASSERT_FALSE(read) << untilt;
    EXPECT_NE(read.error().what.find("unevenly, one of them by 10.00 mm"), std::string::npos) << read.error().what;
  }
}

TEST(Untilt, LeavesAStraightStackAsItIs) {
  const Scratch scratch;
  testing::write_ct_series(scratch / "ct", {}, 5);
  VolumeSource source(scratch / "ct");
  const auto plain = import_volume(source);
  source.untilt = true;
  const auto same = import_with_notes(source);
  ASSERT_TRUE(plain && same);
  EXPECT_EQ(plain->hu, same->volume.hu);
  EXPECT_TRUE(same->notes.empty());
}

}  // namespace
}  // namespace birdseye::host
