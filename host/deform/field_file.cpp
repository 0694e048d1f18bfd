#include <fmt/format.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkVector.h>

#include <Eigen/LU>
#include <cmath>

#include "host/deform/displacement_field.hpp"

namespace birdseye::host {

namespace {

using FieldImage = itk::Image<itk::Vector<float, 3>, 3>;

itk::ImageIOBase::Pointer io_for(const std::filesystem::path& path, bool writing) {
  for (const itk::ImageIOBase::Pointer& io :
       {itk::ImageIOBase::Pointer(itk::MetaImageIO::New()), itk::ImageIOBase::Pointer(itk::NrrdImageIO::New()),
        itk::ImageIOBase::Pointer(itk::NiftiImageIO::New())}) {
    if (writing ? io->CanWriteFile(path.c_str()) : io->CanReadFile(path.c_str())) return io;
  }
  return nullptr;
}

}  // namespace

Result<void> write_field(const std::filesystem::path& path, const DisplacementField& field) {
  const itk::ImageIOBase::Pointer io = io_for(path, true);
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
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  const itk::ImageIOBase::Pointer io = io_for(path, false);
  if (io == nullptr)
    return Error{Errc::bad_format,
                 fmt::format("{}: is no displacement field; give .mha, .nrrd or .nii.gz", path.string())};
  DisplacementField field;
  try {
    io->SetFileName(path.string());
    io->ReadImageInformation();
    if (io->GetNumberOfComponents() != 3) {
      return Error{Errc::bad_format, fmt::format("{}: has {} values a point where a displacement has three",
                                                 path.string(), io->GetNumberOfComponents())};
    }
    const auto reader = itk::ImageFileReader<FieldImage>::New();
    reader->SetImageIO(io);
    reader->SetFileName(path.string());
    reader->Update();
    const FieldImage& image = *reader->GetOutput();
    const auto size = image.GetLargestPossibleRegion().GetSize();
    Eigen::Matrix3d axes;
    for (unsigned row = 0; row < 3; ++row) {
      field.size[row] = static_cast<int>(size[row]);
      field.patient_from_lattice.translation()[row] = image.GetOrigin()[row];
      for (unsigned column = 0; column < 3; ++column)
        axes(row, column) = image.GetDirection()(row, column) * image.GetSpacing()[column];
    }
    field.patient_from_lattice.linear() = axes;
    const std::size_t count = size[0] * size[1] * size[2];
    field.displacement_mm.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto& v = image.GetBufferPointer()[i];
      field.displacement_mm.emplace_back(v[0], v[1], v[2]);
    }
  } catch (const std::exception&) {
    return Error{Errc::unreadable, fmt::format("{}: is cut short or damaged", path.string())};
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
