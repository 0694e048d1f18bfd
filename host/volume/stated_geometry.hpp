#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

struct ImageFile;

/// Where the voxels of a file lie, but for how far they are apart.
struct VoxelPlace {
  Eigen::Matrix3d axes;       ///< columns: which way the voxel axes point, unit length, patient LPS
  Eigen::Vector3d origin_mm;  ///< the centre of the first voxel, patient LPS
};

/// What a file's header does not say, or says twice differently, of where its voxels lie: in words that go on from the
/// file's name; each empty where the header says it once.
struct GeometryGaps {
  std::string spacing;      ///< a person may say it
  std::string orientation;  ///< a person may say it
  std::string beyond;       ///< with its remedy: what no person's word makes good
  std::string place;        ///< where the first voxel lies: of a CT by itself it does not matter
};

/// Of a NRRD's or MetaImage's header; none of any other file. Their readers fill in what is missing, unseen: voxels of
/// 1 mm, axes as the patient's.
GeometryGaps text_header_gaps(const std::filesystem::path& path);

/// What a MetaImage's header says of where its voxels lie and its reader took otherwise, with the remedy; empty where
/// the reader took all as it is said, and of any other file. image: by the reader alone, before put_stated.
std::string misread_geometry(const std::filesystem::path& path, const ImageFile& image);

/// Why the vectors of a NRRD's displacement field are not the patient's LPS, for which they would be taken (the reader
/// turns the place of a field to LPS, and no vectors), with the remedy; empty where they are, and of any other file.
std::string turned_vectors(const std::filesystem::path& path);

/// Whose word counts where a file does not say where its voxels lie.
enum class GeometryFrom { file, file_or_person };

/// Refuses a gap that no person has closed, and a person's word on what the file says itself.
Result<void> check_stated(const VolumeSource& source, GeometryFrom from, const GeometryGaps& gaps);

/// The options that state it, and their values, as a command takes them.
std::vector<std::string> options_of(const StatedGeometry& stated);

/// Puts what a person stated, once check_stated has found it in order, and says so in the image's notes.
/// place: that of the two which the file says; null where it says none, and the first voxel is the origin.
void put_stated(const VolumeSource& source, const VoxelPlace* place, ImageFile& image);

}  // namespace birdseye::host
