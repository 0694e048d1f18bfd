#include <fmt/format.h>

#include "host/dicom/dicom_labels.hpp"
#include "host/volume/decode.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

Result<ImageFile> image_of_labels(const DicomFile& file) {
  auto labels = read_dicom_labels(file.path);
  if (!labels) return labels.error();
  ImageFile image;
  image.size = labels->size;
  image.spacing_mm = labels->spacing_mm;
  image.origin_mm = labels->origin_mm;
  image.axes = labels->axes;
  image.hu = std::move(labels->labels);
  image.label_names = std::move(labels->names);
  image.series_labelled = std::move(labels->series_uids);
  image.patient = file.patient;
  image.frame_of_reference_uid = file.frame_of_reference_uid;
  if (file.frame_of_reference_uid.empty())
    image.notes.emplace_back("has no frame of reference: only its grid tells that it is of this CT");
  return image;
}

}  // namespace

Result<ImageFile> decode_dicom_labels(const fs::path& path, const Announce& announce, std::span<ProcessCopy> copies) {
  const auto scan = scan_dicom(path, announce);
  if (!scan) return scan.error();
  const DicomFile* found = nullptr;
  for (const DicomFile& file : scan->tree.files) {
    if (file.kind != DicomFile::Kind::labels) continue;
    if (found != nullptr) {
      return refused(Errc::unsupported, path,
                     fmt::format("holds several segmentations ({}, {}); give the file of one",
                                 found->path.filename().string(), file.path.filename().string()));
    }
    found = &file;
  }
  if (found == nullptr) return decode_dicom(path, announce, copies);
  announce(found->path);
  return image_of_labels(*found);
}

}  // namespace birdseye::host
