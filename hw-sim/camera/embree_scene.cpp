#include "hw-sim/camera/embree_scene.hpp"

#include <algorithm>

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3f;

Vector3f at_hit(const std::vector<Vector3f>& of_vertices, const std::array<std::uint32_t, 3>& triangle,
                const RTCRayHit8& packet, int lane) {
  const float u = packet.hit.u[lane];
  const float v = packet.hit.v[lane];
  return (1 - u - v) * of_vertices[triangle[0]] + u * of_vertices[triangle[1]] + v * of_vertices[triangle[2]];
}

}  // namespace

void EmbreeScene::add(const Mesh& mesh, unsigned id, const std::vector<Vector3f>& rest) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                        3 * sizeof(float), mesh.vertices.size()));
  for (const Vector3f& p : mesh.vertices) v = std::copy_n(p.data(), 3, v);
  auto* t = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                           3 * sizeof(unsigned), mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) t = std::copy(triangle.begin(), triangle.end(), t);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene_, geometry, id);
  rtcReleaseGeometry(geometry);
  smooth_.resize(std::max<std::size_t>(smooth_.size(), id + 1));
  smooth_[id] = {mesh.triangles, mesh.normals, rest};
}

void EmbreeScene::replace(const Mesh& mesh, unsigned id, const std::vector<Vector3f>& rest) {
  rtcDetachGeometry(scene_, id);
  add(mesh, id, rest);
  commit();
}

Vector3f EmbreeScene::normal(const RTCRayHit8& packet, int lane) const {
  const Smooth& mesh = smooth_[packet.hit.geomID[lane]];
  if (mesh.normals.empty()) return {packet.hit.Ng_x[lane], packet.hit.Ng_y[lane], packet.hit.Ng_z[lane]};
  return at_hit(mesh.normals, mesh.triangles[packet.hit.primID[lane]], packet, lane);
}

Vector3f EmbreeScene::rest(const RTCRayHit8& packet, int lane, const Vector3f& point) const {
  const Smooth& mesh = smooth_[packet.hit.geomID[lane]];
  return mesh.rest.empty() ? point : at_hit(mesh.rest, mesh.triangles[packet.hit.primID[lane]], packet, lane);
}

}  // namespace birdseye::hw_sim
