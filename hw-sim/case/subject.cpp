#include "hw-sim/case/subject.hpp"

#include <fmt/format.h>

#include <cmath>
#include <tuple>
#include <utility>

#include "hw-sim/phantom/body.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "hw-sim/phantom/procedural_head.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr double kMarginMm = 25;  // about the organ, so that it is free to move within the CT's box
constexpr double kSurfaceMm = 1.5;

/// A scan of the box about a surface. Its origin is of whole mm, which every file format holds exactly.
Grid scan_about(const Mesh& surface) {
  const auto [low, high] = bounds(surface);
  Grid grid;
  grid.spacing_mm = {1.25, 1.25, 2.5};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    grid.origin_mm[a] = std::floor(low[a] - kMarginMm);
    grid.size[axis] = static_cast<int>(std::ceil((high[a] + kMarginMm - grid.origin_mm[a]) / grid.spacing_mm[a])) + 1;
  }
  return grid;
}

/// The voxels about a surface, of those of whole; where the margin reaches beyond the scan, blank.
template <typename Voxel>
std::pair<Grid, std::vector<Voxel>> cropped(const Grid& whole, const std::vector<Voxel>& voxels, const Mesh& surface,
                                            Voxel blank) {
  const auto [low, high] = bounds(surface);
  Grid grid = whole;
  std::array<int, 3> first{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const auto voxel = [&](double mm) { return (mm - whole.origin_mm[a]) / whole.spacing_mm[a]; };
    first[axis] = static_cast<int>(std::floor(voxel(low[a] - kMarginMm)));
    grid.size[axis] = static_cast<int>(std::ceil(voxel(high[a] + kMarginMm))) - first[axis] + 1;
  }
  grid.origin_mm = whole.point(first[0], first[1], first[2]);
  std::vector<Voxel> out(grid.voxels(), blank);
  const auto inside = [&](int i, std::size_t axis) { return i >= 0 && i < whole.size[axis]; };
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const int x = first[0] + i;
        const int y = first[1] + j;
        const int z = first[2] + k;
        if (inside(x, 0) && inside(y, 1) && inside(z, 2)) out[grid.index(i, j, k)] = voxels[whole.index(x, y, z)];
      }
    }
  }
  return {grid, std::move(out)};
}

Result<Subject> subject_of(Body body, Mesh surface, std::uint64_t seed) {
  auto implants = choose_implants(body, seed);
  if (!implants) return implants.error();
  implants->markers_mm.clear();  // they stand on the skin, which the cut may not hold
  Subject out;
  out.labels = implant(body, *implants, seed);
  out.grid = body.grid;
  out.hu = std::move(body.hu);
  out.organ_labels = {kLiver, kPortal, kHepatic, kTumour};
  out.transfer = "liver";
  out.surface = std::move(surface);
  out.vessels = implants->portal;
  out.vessels.insert(out.vessels.end(), implants->hepatic.begin(), implants->hepatic.end());
  out.tumour_centre_mm = implants->tumour_centre_mm;
  out.towards_scope = towards_scope();
  out.view_distance_mm = 105;
  return out;
}

}  // namespace

Result<Subject> liver_subject(std::uint64_t seed) {
  Mesh surface = closed_surface(procedural_liver_mm, {-150, -120, -120}, {100, 100, 140}, kSurfaceMm);
  const Grid grid = scan_about(surface);
  return subject_of(procedural_body(seed, grid), std::move(surface), seed);
}

Result<Subject> liver_subject(const std::filesystem::path& ct, const std::filesystem::path& labels, int liver_label,
                              std::uint64_t seed) {
  auto body = body_from_ct(ct, labels, liver_label);
  if (!body) return body.error();
  const Vector3d border = Vector3d::Constant(4 * kSurfaceMm);
  Mesh surface =
      closed_surface(body->liver_mm, body->grid.origin_mm - border, body->grid.last_mm() + border, kSurfaceMm);
  if (surface.vertices.empty()) {
    return Error{Errc::degenerate, fmt::format("{}: no liver is found in it; give its --labels", ct.string())};
  }
  std::tie(body->grid, body->hu) = cropped<std::int16_t>(body->grid, body->hu, surface, -1000);
  auto subject = subject_of(std::move(*body), std::move(surface), seed);
  if (!subject) return subject.error().with_context(ct.string());
  return subject;
}

Result<OrganShape> liver_shape(const std::filesystem::path& phantom) {
  OrganShape out;
  auto surface = read_ply(phantom / "surfaces" / "liver.ply");
  if (!surface) return surface.error();
  const auto whole = read_labels(phantom / "segmentation.nii.gz");
  if (!whole) return whole.error();
  out.surface = *std::move(surface);
  std::tie(out.grid, out.labels) = cropped<std::uint8_t>(whole->grid, whole->labels, out.surface, 0);
  out.organ_labels = {kLiver, kPortal, kHepatic, kTumour};
  out.towards_scope = towards_scope();
  return out;
}

Subject head_subject(std::uint64_t seed) {
  Subject out;
  out.surface = closed_surface(procedural_head_mm, {-100, -130, -145}, {100, 115, 130}, kSurfaceMm);
  out.grid = scan_about(out.surface);
  Head head = procedural_head(seed, out.grid);
  out.hu = std::move(head.hu);
  out.labels = std::move(head.labels);
  out.organ_labels = {kHead, kArtery, kBrainTumour};
  out.transfer = "skin";
  out.coat = Coat::skin;
  out.vessels = std::move(head.arteries);
  out.tumour_centre_mm = head.tumour_centre_mm;
  out.towards_scope = Vector3d(0, -1, 0.05).normalized();
  out.view_distance_mm = 180;
  return out;
}

}  // namespace birdseye::hw_sim
