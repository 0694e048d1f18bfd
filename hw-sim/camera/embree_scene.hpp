#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// Surfaces for rays to hit, in a frame of their own.
class EmbreeScene {
 public:
  explicit EmbreeScene(RTCDevice device) : device_(device), scene_(rtcNewScene(device)) {}
  ~EmbreeScene() { rtcReleaseScene(scene_); }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  /// rest: where each vertex was before the mesh was deformed; empty where it was not.
  void add(const Mesh& mesh, unsigned id, const std::vector<Eigen::Vector3f>& rest = {});
  /// Puts a mesh in the place of the one with this id, and commits.
  void replace(const Mesh& mesh, unsigned id, const std::vector<Eigen::Vector3f>& rest);
  void commit() { rtcCommitScene(scene_); }
  [[nodiscard]] RTCScene get() const { return scene_; }

  /// The normal at a hit: interpolated between the vertices' normals where the mesh has them, else the triangle's.
  [[nodiscard]] Eigen::Vector3f normal(const RTCRayHit8& packet, int lane) const;
  /// Where the point at a hit was before the mesh was deformed.
  [[nodiscard]] Eigen::Vector3f rest(const RTCRayHit8& packet, int lane, const Eigen::Vector3f& point) const;

 private:
  struct Smooth {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<Eigen::Vector3f> normals, rest;
  };
  RTCDevice device_;
  RTCScene scene_;
  std::vector<Smooth> smooth_;  ///< by geometry id
};

}  // namespace birdseye::hw_sim
