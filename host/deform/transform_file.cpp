#include "host/deform/transform_file.hpp"

#include <fmt/format.h>
#include <itkAffineTransform.h>
#include <itkCompositeTransform.h>
#include <itkDisplacementFieldTransform.h>
#include <itkHDF5TransformIO.h>
#include <itkTransformFileReader.h>
#include <itkTransformFileWriter.h>
#include <itkTxtTransformIO.h>

#include "drivers/system/part_file.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

using Affine = itk::AffineTransform<double, 3>;
using Composite = itk::CompositeTransform<double, 3>;
using Displacement = itk::DisplacementFieldTransform<double, 3>;
using Map = itk::Transform<double, 3, 3>;

Affine::Pointer affine_of(const Eigen::Matrix4d& m) {
  const auto affine = Affine::New();
  Affine::MatrixType matrix;
  Affine::OutputVectorType offset;
  for (unsigned row = 0; row < 3; ++row) {
    for (unsigned column = 0; column < 3; ++column) matrix(row, column) = m(row, column);
    offset[row] = m(row, 3);
  }
  affine->SetMatrix(matrix);
  affine->SetOffset(offset);
  return affine;
}

Displacement::Pointer displacement_of(const DisplacementField& field) {
  const auto image = Displacement::DisplacementFieldType::New();
  Displacement::DisplacementFieldType::SizeType size;
  Displacement::DisplacementFieldType::DirectionType direction;
  const Eigen::Matrix3d axes = field.patient_from_lattice.linear();
  const Eigen::Vector3d spacing_mm = axes.colwise().norm();
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(field.size[axis]);
    for (unsigned row = 0; row < 3; ++row) direction(row, axis) = axes(row, axis) / spacing_mm[axis];
  }
  image->SetRegions(size);
  image->SetSpacing(spacing_mm.data());
  image->SetOrigin(field.patient_from_lattice.translation().data());
  image->SetDirection(direction);
  image->Allocate();
  auto* at = image->GetBufferPointer();
  for (const Eigen::Vector3f& u : field.displacement_mm) {
    for (unsigned axis = 0; axis < 3; ++axis) (*at)[axis] = static_cast<double>(u[axis]);
    ++at;
  }
  const auto displacement = Displacement::New();
  displacement->SetDisplacementField(image);
  return displacement;
}

itk::TransformIOBaseTemplate<double>::Pointer io_for(const fs::path& path) {
  if (path.extension() == ".tfm" || path.extension() == ".txt")
    return itk::TxtTransformIOTemplate<double>::New().GetPointer();
  if (path.extension() == ".h5") return itk::HDF5TransformIOTemplate<double>::New().GetPointer();
  return nullptr;
}

Error refused(Errc code, const fs::path& path, const std::string& why) {
  return {code, fmt::format("{}: {}", path.string(), why)};
}

}  // namespace

Eigen::Vector3d RestMap::operator()(const Eigen::Vector3d& seen_mm) const {
  const Eigen::Vector3d in_ct_mm = (ct_from_seen * seen_mm.homogeneous()).hnormalized();
  return field == nullptr ? in_ct_mm : Eigen::Vector3d(in_ct_mm + field->displacement(in_ct_mm));
}

Result<void> write_transform(const fs::path& path, const RestMap& map) {
  const auto io = io_for(path);
  if (io == nullptr) return refused(Errc::bad_value, path, "name it .tfm or .h5");
  auto part = PartFile::make(path);
  if (!part) return part.error();
  try {
    const auto affine = affine_of(map.ct_from_seen);
    const auto writer = itk::TransformFileWriterTemplate<double>::New();
    writer->SetTransformIO(io);
    writer->SetFileName(part->path().string());
    if (map.field == nullptr) {
      writer->SetInput(affine);
    } else {
      // Of a composite, ITK applies what was added last first.
      const auto both = Composite::New();
      both->AddTransform(displacement_of(*map.field));
      both->AddTransform(affine);
      writer->SetInput(both);
    }
    writer->Update();
    return part->put_durably();
  } catch (const std::exception&) {
    return refused(Errc::unreadable, path,
                   "cannot be written; check the folder and its permissions, and whether the disk is full");
  }
}

Result<std::vector<Eigen::Vector3d>> transform_by_file(const fs::path& path,
                                                       const std::vector<Eigen::Vector3d>& points_mm) {
  const auto io = io_for(path);
  if (io == nullptr) return refused(Errc::bad_value, path, "is no .tfm or .h5");
  try {
    const auto reader = itk::TransformFileReaderTemplate<double>::New();
    reader->SetTransformIO(io);
    reader->SetFileName(path.string());
    reader->Update();
    const auto* const list = reader->GetTransformList();
    const Map* const map = list->empty() ? nullptr : dynamic_cast<const Map*>(list->front().GetPointer());
    if (map == nullptr) return refused(Errc::bad_format, path, "holds no transform of three dimensions");
    std::vector<Eigen::Vector3d> out;
    out.reserve(points_mm.size());
    for (const Eigen::Vector3d& p : points_mm) {
      const Map::InputPointType at(p.data());
      const Map::OutputPointType to = map->TransformPoint(at);
      out.emplace_back(to[0], to[1], to[2]);
    }
    return out;
  } catch (const std::exception&) {
    return refused(Errc::bad_format, path, "is no transform that ITK reads, or is cut short");
  }
}

}  // namespace birdseye::host
