#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "host/deform/displacement_field.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

Result<void> write_field(const std::filesystem::path& path, const DisplacementField& field) {
  ImageFile image;
  image.size = field.size;
  image.components = 3;
  image.origin_mm = field.patient_from_lattice.translation();
  image.spacing_mm = field.patient_from_lattice.linear().colwise().norm();
  image.axes = field.patient_from_lattice.linear().colwise().normalized();
  image.values.reserve(3 * field.displacement_mm.size());
  for (const Eigen::Vector3f& u : field.displacement_mm) image.values.insert(image.values.end(), u.begin(), u.end());
  return write_image(path, image, StoredAs::float32);
}

Result<void> check_sound(const DisplacementField& field) {
  constexpr float kFarthest_mm = 1000;  // farther than anything in a patient moves
  for (const Eigen::Vector3f& u : field.displacement_mm) {
    if (!u.allFinite()) return Error{Errc::bad_value, "has displacements that are not finite numbers"};
    if (u.norm() > kFarthest_mm) {
      return Error{
          Errc::bad_value,
          fmt::format("has a displacement of {:.3g} mm; give displacements in mm, as an organ moves", u.norm())};
    }
  }
  if (std::min({field.size[0], field.size[1], field.size[2]}) < 2)
    return Error{Errc::bad_value, "is no volume of displacements: every axis needs at least two points"};
  if (!(least_determinant(field) > 0))
    return Error{Errc::bad_value, "the field folds: tissue would pass through itself; smooth it or lessen it"};
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
  if (auto sound = check_sound(field); !sound) return sound.error().with_context(path.string());
  return field;
}

}  // namespace birdseye::host
