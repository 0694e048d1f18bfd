#include "host/render/gl/gl_slice_renderer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calibration/geometry/lens_fold.hpp"
#include "host/render/gl/slice_shaders.hpp"
#include "host/render/gl/uniforms.hpp"

namespace birdseye::host {

namespace {

constexpr int kCells = PatchOctree::kLattice;  // patches along an axis: those of the deepest octree
constexpr int kPoints = kCells + 1;

struct Vertex {
  Eigen::Vector3f at, from;
  std::int32_t patch;
};

std::size_t point(int i, int j, int k) {
  return (static_cast<std::size_t>(k) * kPoints + static_cast<std::size_t>(j)) * kPoints + static_cast<std::size_t>(i);
}

}  // namespace

Result<std::unique_ptr<GlSliceRenderer>> GlSliceRenderer::create(GlContext& /*context*/, const Volume& volume,
                                                                 const TransferFunction& transfer, bool prune) {
  const auto& n = volume.size;
  if (*std::min_element(n.begin(), n.end()) < 2) {
    return Error{Errc::unsupported, "OpenGL: slices need a volume of two voxels or more along every axis"};
  }
  if (auto fits = check_texture_size(n); !fits) return fits.error();
  std::unique_ptr<GlSliceRenderer> made(new GlSliceRenderer(volume, transfer, prune));
  auto draw = make_program({{GL_VERTEX_SHADER, shaders::kSliceVertex}, {GL_FRAGMENT_SHADER, shaders::kSliceFragment}});
  if (!draw) return draw.error();
  made->draw_ = *std::move(draw);
  auto gradient = make_program({{GL_COMPUTE_SHADER, shaders::kGradient}});
  if (!gradient) return gradient.error();

  made->hu_ = make_texture(GL_TEXTURE_3D, GL_R32F, n[0], n[1], n[2]);
  const std::vector<float> hu(volume.hu.begin(), volume.hu.end());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage3D(made->hu_.id(), 0, 0, 0, 0, n[0], n[1], n[2], GL_RED, GL_FLOAT, hu.data());
  made->gradient_ = make_texture(GL_TEXTURE_3D, GL_RGBA16F, n[0], n[1], n[2]);
  glBindTextureUnit(0, made->hu_.id());
  glBindImageTexture(0, made->gradient_.id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA16F);
  dispatch(*gradient, n.data(), 8, 4, 4);
  for (const GLuint texture : {made->hu_.id(), made->gradient_.id()}) {
    for (const GLenum filter : {GLenum{GL_TEXTURE_MIN_FILTER}, GLenum{GL_TEXTURE_MAG_FILTER}})
      glTextureParameteri(texture, filter, GL_LINEAR);
  }
  std::vector<Eigen::Vector4f> table;
  for (int at = TransferFunction::kLowestHu; at <= TransferFunction::kHighestHu; ++at) {
    const TransferFunction::Entry& entry = transfer.at(at);
    table.emplace_back(entry.r, entry.g, entry.b, entry.extinction_per_mm);
  }
  made->transfer_table_ = make_texture(GL_TEXTURE_2D, GL_RGBA32F, 64, 64, 1);
  glTextureSubImage2D(made->transfer_table_.id(), 0, 0, 0, 64, 64, GL_RGBA, GL_FLOAT, table.data());
  GLuint id = 0;
  glCreateFramebuffers(1, &id);
  made->framebuffer_ = GlFramebuffer(id);
  made->undeform();
  return made;
}

void GlSliceRenderer::undeform() {
  measure_moves(nullptr);
}
void GlSliceRenderer::deform(const DisplacementField& field) {
  measure_moves(&field);
}

void GlSliceRenderer::measure_moves(const DisplacementField* field) {
  const Eigen::Affine3d& patient_from_voxel = volume_.patient_from_voxel;
  const Eigen::Matrix3d voxel_from_patient = patient_from_voxel.linear().inverse();
  const Eigen::Vector3d step(static_cast<double>(volume_.size[0] - 1) / kCells,
                             static_cast<double>(volume_.size[1] - 1) / kCells,
                             static_cast<double>(volume_.size[2] - 1) / kCells);
  moves_.assign(static_cast<std::size_t>(kPoints) * kPoints * kPoints, Eigen::Vector3f::Zero());
  if (field != nullptr) {
    for (int k = 0; k < kPoints; ++k) {
      for (int j = 0; j < kPoints; ++j) {
        for (int i = 0; i < kPoints; ++i) {
          const Eigen::Vector3d voxel = step.cwiseProduct(Eigen::Vector3d(i, j, k));
          moves_[point(i, j, k)] = (voxel_from_patient * field->displacement(patient_from_voxel * voxel)).cast<float>();
        }
      }
    }
  }
  // Each patch's affine map: the mean of its edges' slopes along each axis.
  std::vector<Eigen::Matrix4f> affine;
  affine.reserve(static_cast<std::size_t>(kCells) * kCells * kCells);
  for (int k = 0; k < kCells; ++k) {
    for (int j = 0; j < kCells; ++j) {
      for (int i = 0; i < kCells; ++i) {
        Eigen::Matrix4f m = Eigen::Matrix4f::Identity();
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3f slope = Eigen::Vector3f::Zero();
          for (int edge = 0; edge < 4; ++edge) {
            int at[3] = {i, j, k};
            at[(axis + 1) % 3] += edge & 1;
            at[(axis + 2) % 3] += edge >> 1;
            const Eigen::Vector3f& low = moves_[point(at[0], at[1], at[2])];
            ++at[axis];
            slope += moves_[point(at[0], at[1], at[2])] - low;
          }
          m.col(axis).head<3>() += slope / static_cast<float>(4 * step[axis]);
        }
        affine.push_back(m);
      }
    }
  }
  affine_ = make_buffer(static_cast<GLsizeiptr>(affine.size() * sizeof(Eigen::Matrix4f)), affine.data());
  for (auto& slices : slices_) slices.reset();
}

const GlSliceRenderer::Slices& GlSliceRenderer::slices_along(int axis) {
  std::optional<Slices>& cached = slices_[static_cast<std::size_t>(axis)];
  if (cached) return *cached;
  Slices made;
  const int count = volume_.size[static_cast<std::size_t>(axis)];
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const auto step = [&](int a) { return static_cast<float>(volume_.size[static_cast<std::size_t>(a)] - 1) / kCells; };
  std::vector<Vertex> vertices;
  std::vector<GLuint> indices;
  for (int slice = 0; slice < count; ++slice) {
    made.first.push_back(static_cast<GLuint>(indices.size()));
    const float layer = static_cast<float>(slice) / step(axis);
    const int below = std::min(static_cast<int>(layer), kCells - 1);
    const float t = layer - static_cast<float>(below);
    const auto vertex_at = [&](float pu, float pv, const Eigen::Vector3f& move, std::int32_t patch) {
      Vertex vertex;
      vertex.at[axis] = static_cast<float>(slice);
      vertex.at[u] = pu * step(u);
      vertex.at[v] = pv * step(v);
      vertex.from = vertex.at + move;
      vertex.patch = patch;
      return vertex;
    };
    const auto move_at = [&](int pu, int pv) {
      int at[3];
      at[axis] = below;
      at[u] = pu;
      at[v] = pv;
      const Eigen::Vector3f& low = moves_[point(at[0], at[1], at[2])];
      ++at[axis];
      return Eigen::Vector3f(low + t * (moves_[point(at[0], at[1], at[2])] - low));
    };
    for (int pv = 0; pv < kCells; ++pv) {
      for (int pu = 0; pu < kCells; ++pu) {
        int cell[3];
        cell[axis] = below;
        cell[u] = pu;
        cell[v] = pv;
        const std::int32_t patch = (cell[2] * kCells + cell[1]) * kCells + cell[0];
        const std::array<Eigen::Vector3f, 4> moves{move_at(pu, pv), move_at(pu + 1, pv), move_at(pu + 1, pv + 1),
                                                   move_at(pu, pv + 1)};
        const auto fu = static_cast<float>(pu);
        const auto fv = static_cast<float>(pv);
        const std::array<Vertex, 5> corners{
            vertex_at(fu, fv, moves[0], patch), vertex_at(fu + 1, fv, moves[1], patch),
            vertex_at(fu + 1, fv + 1, moves[2], patch), vertex_at(fu, fv + 1, moves[3], patch),
            // The middle, where two triangles would leave the bilinear map.
            vertex_at(fu + 0.5F, fv + 0.5F, 0.25F * (moves[0] + moves[1] + moves[2] + moves[3]), patch)};
        Eigen::Array3f low = corners[0].from.array();
        Eigen::Array3f high = low;
        for (const Vertex& corner : corners) {
          low = low.min(corner.from.array());
          high = high.max(corner.from.array());
        }
        if (prune_ && !seen_.any(low, high)) continue;
        const auto first = static_cast<GLuint>(vertices.size());
        vertices.insert(vertices.end(), corners.begin(), corners.end());
        for (GLuint side = 0; side < 4; ++side) {
          indices.insert(indices.end(), {first + side, first + (side + 1) % 4, first + 4});
        }
      }
    }
    made.count.push_back(static_cast<GLuint>(indices.size()) - made.first.back());
  }
  made.vertices = make_buffer(std::max<GLsizeiptr>(1, static_cast<GLsizeiptr>(vertices.size() * sizeof(Vertex))),
                              vertices.empty() ? nullptr : vertices.data());
  made.indices = make_buffer(std::max<GLsizeiptr>(1, static_cast<GLsizeiptr>(indices.size() * sizeof(GLuint))),
                             indices.empty() ? nullptr : indices.data());
  GLuint id = 0;
  glCreateVertexArrays(1, &id);
  made.array = GlVertexArray(id);
  glVertexArrayVertexBuffer(id, 0, made.vertices.id(), 0, sizeof(Vertex));
  glVertexArrayElementBuffer(id, made.indices.id());
  for (const GLuint attribute : {0U, 1U, 2U}) {
    glEnableVertexArrayAttrib(id, attribute);
    glVertexArrayAttribBinding(id, attribute, 0);
  }
  glVertexArrayAttribFormat(id, 0, 3, GL_FLOAT, GL_FALSE, offsetof(Vertex, at));
  glVertexArrayAttribFormat(id, 1, 3, GL_FLOAT, GL_FALSE, offsetof(Vertex, from));
  glVertexArrayAttribIFormat(id, 2, 1, GL_INT, offsetof(Vertex, patch));
  cached = std::move(made);
  return *cached;
}

ImageRgba GlSliceRenderer::render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                  const RenderSettings& settings) {
  if (camera.width_px != width_px_ || camera.height_px != height_px_) {
    // Halves of floats: hundreds of thin layers in eight bits would not add up.
    target_ = make_texture(GL_TEXTURE_2D, GL_RGBA16F, camera.width_px, camera.height_px, 1);
    glNamedFramebufferTexture(framebuffer_.id(), GL_COLOR_ATTACHMENT0, target_.id(), 0);
    width_px_ = camera.width_px;
    height_px_ = camera.height_px;
  }
  const Transform<Patient, Camera> patient_from_camera = camera_from_patient.inverse();
  const Eigen::Affine3d& patient_from_voxel = volume_.patient_from_voxel;
  const Eigen::Vector3d eye_in_voxels =
      patient_from_voxel.inverse() * Eigen::Vector3d(patient_from_camera.translation());
  // The axis that the camera looks along most.
  const Eigen::Vector3d forward = patient_from_camera.rotation().col(2);
  int axis = 0;
  for (int a = 1; a < 3; ++a) {
    const auto along = [&](int b) { return std::abs(patient_from_voxel.linear().col(b).normalized().dot(forward)); };
    if (along(a) > along(axis)) axis = a;
  }
  const Slices& slices = slices_along(axis);

  set(draw_, "camera_from_voxel", Eigen::Affine3d(Eigen::Affine3d(camera_from_patient.matrix()) * patient_from_voxel));
  set(draw_, "lens", Eigen::Vector4d(camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px));
  set(draw_, "distortion", Eigen::Vector4d(camera.k1, camera.k2, camera.p1, camera.p2));
  set(draw_, "k3", camera.k3);
  if (!(camera == folded_)) {
    fold_ = std::min(fold_radius(camera), kWidestTangent);
    folded_ = camera;
  }
  set(draw_, "fold", fold_);
  set(draw_, "size_px", Eigen::Vector2d(camera.width_px, camera.height_px));
  set(draw_, "patient_gradient", Eigen::Matrix3d(patient_from_voxel.linear().inverse().transpose()));
  set(draw_, "patient_from_camera", Eigen::Matrix3d(patient_from_camera.rotation()));
  const Eigen::Matrix3d axes = patient_from_voxel.linear();
  // Across the slices: normal to the two axes that span them.
  const Eigen::Vector3d across = axes.col((axis + 1) % 3).cross(axes.col((axis + 2) % 3)).normalized();
  set(draw_, "axis", Eigen::Vector3d(camera_from_patient.rotation() * across));
  set(draw_, "spacing_mm", volume_.spacing_mm[axis]);
  set(draw_, "lamp", Eigen::Vector4d(settings.ambient, settings.diffuse, settings.specular, settings.shininess));
  set(draw_, "per_surface_gradient", 1 / settings.surface_gradient_hu_per_mm);
  Eigen::Vector4d clip(0, 0, 0, 1);
  if (settings.clip) {
    clip.head<3>() = camera_from_patient.rotation() * settings.clip->normal;
    clip[3] = settings.clip->normal.dot(Eigen::Vector3d(patient_from_camera.translation())) - settings.clip->offset_mm;
  }
  set(draw_, "clip", clip);
  set(draw_, "near_mm", settings.near_mm);

  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, camera.width_px, camera.height_px);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  const GLuint textures[] = {hu_.id(), gradient_.id(), transfer_table_.id()};
  glBindTextures(0, 3, textures);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, affine_.id());
  glBindVertexArray(slices.array.id());
  glUseProgram(draw_.id());
  // From the slice that is furthest from the camera to the nearest.
  std::vector<std::size_t> order(slices.count.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(static_cast<double>(a) - eye_in_voxels[axis]) >
           std::abs(static_cast<double>(b) - eye_in_voxels[axis]);
  });
  for (const std::size_t slice : order) {
    if (slices.count[slice] == 0) continue;
    glDrawElements(
        GL_TRIANGLES, static_cast<GLsizei>(slices.count[slice]), GL_UNSIGNED_INT,
        reinterpret_cast<const void*>(slices.first[slice] * sizeof(GLuint)));  // NOLINT: OpenGL's way to say an offset
  }
  glDisable(GL_BLEND);
  return read_picture(camera.width_px, camera.height_px);
}

}  // namespace birdseye::host
