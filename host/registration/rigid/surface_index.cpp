#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "host/registration/rigid/surface.hpp"

namespace birdseye::host {

namespace {

/// The point of a triangle nearest to p. Source: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b);
  return a + vb / (va + vb + vc) * ab + vc / (va + vb + vc) * ac;
}

}  // namespace

struct SurfaceIndex::Tree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Surface surface;

  Tree() = default;
  ~Tree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  [[nodiscard]] std::array<Eigen::Vector3d, 3> corners(std::uint32_t triangle) const {
    const auto& t = surface.triangles[triangle];
    return {surface.vertices_mm[t[0]].cast<double>(), surface.vertices_mm[t[1]].cast<double>(),
            surface.vertices_mm[t[2]].cast<double>()};
  }
};

SurfaceIndex::SurfaceIndex(const Surface& surface) : tree_(std::make_unique<Tree>()) {
  tree_->surface = surface;
  tree_->device = rtcNewDevice(nullptr);
  tree_->scene = rtcNewScene(tree_->device);
  RTCGeometry geometry = rtcNewGeometry(tree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                        3 * sizeof(float), surface.vertices_mm.size()));
  for (const Eigen::Vector3f& p : surface.vertices_mm) v = std::copy_n(p.data(), 3, v);
  auto* t = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                3 * sizeof(std::uint32_t), surface.triangles.size()));
  for (const auto& triangle : surface.triangles) t = std::copy(triangle.begin(), triangle.end(), t);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(tree_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(tree_->scene);
}

SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
SurfaceIndex& SurfaceIndex::operator=(SurfaceIndex&&) noexcept = default;

SurfacePoint SurfaceIndex::nearest(const Eigen::Vector3d& point_mm) const {
  struct Search {
    const Tree& tree;
    Eigen::Vector3d point_mm;
    SurfacePoint best;
  } search{*tree_, point_mm, {}};
  search.best.distance_mm = std::numeric_limits<double>::infinity();
  RTCPointQuery query{};
  query.x = static_cast<float>(point_mm.x());
  query.y = static_cast<float>(point_mm.y());
  query.z = static_cast<float>(point_mm.z());
  query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  const auto look = [](RTCPointQueryFunctionArguments* arguments) {
    auto& s = *static_cast<Search*>(arguments->userPtr);
    const auto [a, b, c] = s.tree.corners(arguments->primID);
    const Eigen::Vector3d here = nearest_in_triangle(s.point_mm, a, b, c);
    const double distance = (here - s.point_mm).norm();
    if (distance >= s.best.distance_mm) return false;
    s.best = {here, (b - a).cross(c - a).normalized(), distance};
    // A little more than found, so that single precision loses no nearer triangle.
    arguments->query->radius = static_cast<float>(distance * 1.00001 + 1e-4);
    return true;
  };
  rtcPointQuery(tree_->scene, &query, &context, look, &search);
  return search.best;
}

std::optional<double> SurfaceIndex::first_hit_mm(const Eigen::Vector3d& origin_mm,
                                                 const Eigen::Vector3d& direction) const {
  // Embree ends the program over a ray that is longer, or not finite.
  constexpr double kMost_mm = 1e18;
  if (!(origin_mm.cwiseAbs().sum() + direction.cwiseAbs().sum() < kMost_mm)) return std::nullopt;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin_mm.x());
  ray.ray.org_y = static_cast<float>(origin_mm.y());
  ray.ray.org_z = static_cast<float>(origin_mm.z());
  ray.ray.dir_x = static_cast<float>(direction.x());
  ray.ray.dir_y = static_cast<float>(direction.y());
  ray.ray.dir_z = static_cast<float>(direction.z());
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(tree_->scene, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return static_cast<double>(ray.ray.tfar);
}

}  // namespace birdseye::host
