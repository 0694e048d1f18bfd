#include <fmt/format.h>
#include <itkImage.h>
#include <itkImageFileWriter.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkVector.h>

#include <Eigen/LU>
#include <cmath>

#include "host/deform/displacement_field.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

namespace {

using FieldImage = itk::Image<itk::Vector<float, 3>, 3>;

itk::ImageIOBase::Pointer writer_for(const std::filesystem::path& path) {
  for (const itk::ImageIOBase::Pointer& io :
       {itk::ImageIOBase::Pointer(itk::MetaImageIO::New()), itk::ImageIOBase::Pointer(itk::NrrdImageIO::New()),
        itk::ImageIOBase::Pointer(itk::NiftiImageIO::New())}) {
    if (io->CanWriteFile(path.c_str())) return io;
  }
  return nullptr;
}

}  // namespace

Result<void> write_field(const std::filesystem::path& path, const DisplacementField& field) {
  const itk::ImageIOBase::Pointer io = writer_for(path);
  if (io == nullptr) return Error{Errc::bad_value, fmt::format("{}: name it .mha, .nrrd or .nii.gz", path.string())};
  const auto image = FieldImage::New();
  FieldImage::SizeType size;
  FieldImage::PointType origin;
  FieldImage::SpacingType spacing;
  FieldImage::DirectionType direction;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d column = field.patient_from_lattice.linear().col(axis);
    size[axis] = static_cast<itk::SizeValueType>(field.size[axis]);
    origin[axis] = field.patient_from_lattice.translation()[axis];
    spacing[axis] = column.norm();
    for (unsigned row = 0; row < 3; ++row) direction(row, axis) = column[row] / column.norm();
  }
  image->SetRegions(size);
  image->SetOrigin(origin);
  image->SetSpacing(spacing);
  try {
    image->SetDirection(direction);
    image->Allocate();
    for (std::size_t i = 0; i < field.displacement_mm.size(); ++i) {
      for (unsigned axis = 0; axis < 3; ++axis) image->GetBufferPointer()[i][axis] = field.displacement_mm[i][axis];
    }
    const auto writer = itk::ImageFileWriter<FieldImage>::New();
    writer->SetInput(image);
    writer->SetImageIO(io);
    writer->SetFileName(path.string());
    writer->Update();
  } catch (const std::exception&) {
    return Error{Errc::unreadable, fmt::format("{}: cannot be written; does its folder exist?", path.string())};
  }
  return {};
}

Result<DisplacementField> read_field(const std::filesystem::path& path) {
  const auto image = read_image(path, 3);
  if (!image) return image.error();
  DisplacementField field;
  field.size = image->size;
  field.patient_from_lattice.linear() = image->axes * image->spacing_mm.asDiagonal();
  field.patient_from_lattice.translation() = image->origin_mm;
  field.displacement_mm.reserve(image->values.size() / 3);
  for (std::size_t i = 0; i < image->values.size(); i += 3) {
    field.displacement_mm.emplace_back(image->values[i], image->values[i + 1], image->values[i + 2]);
  }
  for (const Eigen::Vector3f& u : field.displacement_mm) {
    if (!u.allFinite())
      return Error{Errc::bad_value, fmt::format("{}: has displacements that are not finite numbers", path.string())};
  }
  if (std::min({field.size[0], field.size[1], field.size[2]}) < 2) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is no volume of displacements: every axis needs at least two points", path.string())};
  }
  if (!(least_determinant(field) > 0)) {
    return Error{
        Errc::bad_value,
        fmt::format("{}: the field folds: tissue would pass through itself; smooth it or lessen it", path.string())};
  }
  return field;
}

}  // namespace birdseye::host
