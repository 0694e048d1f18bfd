#include "host/overlay/ct_sha256.hpp"

#include <span>

#include "calibration/record/sha256.hpp"

namespace birdseye::host {

namespace {

template <typename T>
std::span<const std::uint8_t> bytes_of(const T* data, std::size_t count) {
  return {reinterpret_cast<const std::uint8_t*>(data), count * sizeof(T)};
}

}  // namespace

std::string ct_sha256(const Volume& ct) {
  calibration::Sha256 sum;
  sum.add(bytes_of(ct.hu.data(), ct.hu.size()));
  sum.add(bytes_of(ct.size.data(), ct.size.size()));
  const Eigen::Matrix4d place = ct.patient_from_voxel.matrix();
  sum.add(bytes_of(place.data(), 16));
  return sum.hex();
}

}  // namespace birdseye::host
