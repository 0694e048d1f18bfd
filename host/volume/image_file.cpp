#include "host/volume/image_file.hpp"

#include <fmt/format.h>
#include <tbb/info.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "host/volume/decode.hpp"
#include "host/volume/decode_slices.hpp"
#include "host/volume/decoder_process.hpp"
#include "host/volume/nifti_label_names.hpp"
#include "host/volume/series_list.hpp"
#include "host/volume/slicer_label_names.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostTexts = 1'000'000;

void send_texts(const Send& send, const std::vector<std::string>& texts) {
  const std::size_t count = texts.size();
  send(&count, sizeof count);
  for (const std::string& text : texts) send_long_text(send, text);
}

void send_image(const Send& send, const ImageFile& image) {
  send(image.size.data(), sizeof image.size);
  send(image.spacing_mm.data(), 3 * sizeof(double));
  send(image.origin_mm.data(), 3 * sizeof(double));
  send(image.axes.data(), 9 * sizeof(double));
  send(image.hu.data(), image.hu.size() * sizeof image.hu[0]);
  send(image.values.data(), image.values.size() * sizeof image.values[0]);
  const PatientIdentity& patient = image.patient;
  for (const std::string* text : {&patient.name, &patient.id, &patient.birth_date, &patient.ct_date,
                                  &image.frame_of_reference_uid, &image.series_uid})
    send_long_text(send, *text);
  send_texts(send, image.series_labelled);
  send_texts(send, image.notes);
  const std::size_t labels = image.label_names.size();
  send(&labels, sizeof labels);
  for (const NamedLabel& label : image.label_names) {
    send_long_text(send, label.name);
    send(&label.number, sizeof label.number);
    const std::size_t values = label.values.size();
    send(&values, sizeof values);
    send(label.values.data(), values * sizeof label.values[0]);
  }
}

Result<ImageFile> decode(const VolumeSource& source, int components, GeometryFrom from, const Announce& announce,
                         std::span<ProcessCopy> copies) {
  const fs::path& path = source.path;
  if (holds_dicom(path)) {
    if (auto stated = check_stated(source, from, {}); !stated) return stated.error();
    return decode_dicom(source, announce, copies);
  }
  announce(path);
  if (!source.series.empty())
    return refused(Errc::bad_value, path, "is one volume, of which --series cannot choose; leave it out");
  if (components != 1) return decode_image_file(source, components, from);
  auto by_slicer = slicer_label_names(path);
  if (!by_slicer) return by_slicer.error();
  auto image = decode_image_file(source, components, from);
  if (!image) return image;
  auto names = by_slicer->empty() ? nifti_label_names(path) : std::move(by_slicer);
  if (!names) return names.error();
  image->label_names = *std::move(names);
  return image;
}

bool receive_texts(const Receive& receive, std::vector<std::string>& texts) {
  std::size_t count = 0;
  if (!receive(&count, sizeof count) || count > kMostTexts) return false;
  for (std::size_t i = 0; i < count; ++i) {
    auto text = receive_long_text(receive);
    if (!text) return false;
    texts.push_back(*std::move(text));
  }
  return true;
}

bool receive_label_names(const Receive& receive, std::vector<NamedLabel>& names) {
  std::size_t count = 0;
  if (!receive(&count, sizeof count) || count > kMostTexts) return false;
  for (std::size_t i = 0; i < count; ++i) {
    NamedLabel label;
    std::size_t values = 0;
    auto name = receive_long_text(receive);
    if (!name || !receive(&label.number, sizeof label.number) || !receive(&values, sizeof values) ||
        values > kMostTexts) {
      return false;
    }
    auto received = receive_values<int>(receive, values);
    if (!received) return false;
    label.name = *std::move(name);
    label.values = *std::move(received);
    names.push_back(std::move(label));
  }
  return true;
}

std::optional<ImageFile> receive_image(const Receive& receive, int components) {
  ImageFile image;
  image.components = components;
  if (!receive(image.size.data(), sizeof image.size) || !receive(image.spacing_mm.data(), 3 * sizeof(double)) ||
      !receive(image.origin_mm.data(), 3 * sizeof(double)) || !receive(image.axes.data(), 9 * sizeof(double))) {
    return std::nullopt;
  }
  constexpr int kMost = 65535;
  std::size_t count = static_cast<std::size_t>(components);
  for (const int n : image.size) {
    if (n < 0 || n > kMost) return std::nullopt;
    count *= static_cast<std::size_t>(n);
  }
  if (components == 1) {
    auto hu = receive_values<std::int16_t>(receive, count);
    if (!hu) return std::nullopt;
    image.hu = *std::move(hu);
  } else {
    auto values = receive_values<float>(receive, count);
    if (!values) return std::nullopt;
    image.values = *std::move(values);
  }
  PatientIdentity& patient = image.patient;
  for (std::string* text : {&patient.name, &patient.id, &patient.birth_date, &patient.ct_date,
                            &image.frame_of_reference_uid, &image.series_uid}) {
    auto received = receive_long_text(receive);
    if (!received) return std::nullopt;
    *text = *std::move(received);
  }
  if (!receive_texts(receive, image.series_labelled) || !receive_texts(receive, image.notes) ||
      !receive_label_names(receive, image.label_names))
    return std::nullopt;
  return image;
}

/// Whether the image lies somewhere that a patient can.
Result<void> check_geometry(const fs::path& path, const ImageFile& image) {
  constexpr double kFurthest_mm = 1e5;
  for (const int n : image.size) {
    if (n < 1) return refused(Errc::bad_value, path, "holds no voxels; export it again");
  }
  if (!image.origin_mm.allFinite() || image.origin_mm.cwiseAbs().maxCoeff() > kFurthest_mm) {
    return refused(Errc::bad_value, path, "has no sensible place in the patient; export it again");
  }
  // The grid of a displacement field may be as wide as its author likes.
  constexpr double kLeastSpacing_mm = 0.02, kWidestSpacing_mm = 20;
  constexpr double kRounding = 1e-6;  // NIfTI's spacings are floats: their 0.02 is less than this one
  const double least_mm = image.spacing_mm.minCoeff(), widest_mm = image.spacing_mm.maxCoeff();
  if (!image.spacing_mm.allFinite() || !(least_mm > 0) || widest_mm > kFurthest_mm)
    return refused(Errc::bad_value, path, "has no sensible voxel spacing; export it again");
  if (image.components == 1 && least_mm < (1 - kRounding) * kLeastSpacing_mm) {
    return refused(Errc::bad_value, path,
                   fmt::format("has voxels {:.4g} mm apart, and those of a CT are {:.2g} to {:.2g} mm apart; is it in "
                               "metres? Export it in mm",
                               least_mm, kLeastSpacing_mm, kWidestSpacing_mm));
  }
  if (image.components == 1 && widest_mm > (1 + kRounding) * kWidestSpacing_mm) {
    return refused(Errc::bad_value, path,
                   fmt::format("has voxels {:.4g} mm apart, and those of a CT are {:.2g} to {:.2g} mm apart; is it in "
                               "another unit than mm? Export it in mm",
                               widest_mm, kLeastSpacing_mm, kWidestSpacing_mm));
  }
  if (!image.axes.allFinite() || !(image.axes.transpose() * image.axes).isIdentity(1e-3)) {
    return refused(Errc::unsupported, path, "its axes are sheared or have no length; resample it first");
  }
  return {};
}

/// What decode gives, from a process of its own.
Result<ImageFile> read_apart(
    const fs::path& path, int components, const std::stop_token& stop,
    const std::function<Result<ImageFile>(const Announce&, std::span<ProcessCopy>)>& decode_file) {
  if (auto there = check_can_be_opened(path); !there) return there.error();
  const auto work = [&](const Announce& announce, std::span<ProcessCopy> copies) -> Result<SendDecoded> {
    auto image = decode_file(announce, copies);
    if (!image) return image.error();
    if (image->components != components) return refused(Errc::unsupported, path, "is a CT; give a displacement field");
    return SendDecoded(
        [sent = std::make_shared<ImageFile>(*std::move(image))](const Send& send) { send_image(send, *sent); });
  };
  std::optional<ImageFile> image;
  const auto take = [&](const Receive& receive) {
    image = receive_image(receive, components);
    return image.has_value();
  };
  // Made before it is known whether slices are compressed: each costs some milliseconds of a large program.
  constexpr int kMostCopies = 16;
  const int most = std::min(kMostCopies, tbb::info::default_concurrency());
  const ConfinedCopies copies{holds_dicom(path) ? most : 0, send_slices};
  if (auto ran = run_decoder(path, copies, work, take, stop); !ran) return ran.error();
  if (auto sound = check_geometry(path, *image); !sound) return sound.error();
  return *std::move(image);
}

}  // namespace

Result<ImageFile> read_image(const VolumeSource& source, int components, const std::stop_token& stop) {
  const GeometryFrom from = components == 1 ? GeometryFrom::file_or_person : GeometryFrom::file;
  return read_apart(source.path, components, stop, [&](const Announce& announce, std::span<ProcessCopy> copies) {
    return decode(source, components, from, announce, copies);
  });
}

Result<ImageFile> read_labels_file(const fs::path& path, const std::stop_token& stop) {
  return read_apart(path, 1, stop, [&](const Announce& announce, std::span<ProcessCopy> copies) {
    return holds_dicom(path) ? decode_dicom_labels(path, announce, copies)
                             : decode(path, 1, GeometryFrom::file, announce, copies);
  });
}

}  // namespace birdseye::host
