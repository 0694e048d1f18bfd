#include "host/render/gl/gl_ray_caster.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/render/gl/ray_caster_shaders.hpp"
#include "host/render/gl/uniforms.hpp"

namespace birdseye::host {

namespace {

constexpr int kBrick = 4;
constexpr int kLeaps = 16;  // bricks that one leap may take
constexpr int kEntries = TransferFunction::kHighestHu - TransferFunction::kLowestHu + 1;

}  // namespace

Result<std::unique_ptr<GlRayCaster>> GlRayCaster::create(GlContext& /*context*/, const Volume& volume,
                                                         const TransferFunction& transfer, bool prune) {
  if (auto fits = check_texture_size(volume.size); !fits) return fits.error();
  std::unique_ptr<GlRayCaster> made(new GlRayCaster(volume, transfer));
  const std::pair<GlProgram*, const char*> computed[] = {{&made->warp_, shaders::kWarp},
                                                         {&made->light_, shaders::kLight},
                                                         {&made->seen_, shaders::kSeen},
                                                         {&made->grow_, shaders::kGrow}};
  for (const auto& [program, text] : computed) {
    auto compiled = make_program({{GL_COMPUTE_SHADER, text}});
    if (!compiled) return compiled.error();
    *program = *std::move(compiled);
  }
  auto cast = make_program({{GL_VERTEX_SHADER, shaders::kWhole}, {GL_FRAGMENT_SHADER, shaders::kCast}});
  if (!cast) return cast.error();
  made->cast_ = *std::move(cast);

  const auto& n = volume.size;
  made->scan_hu_ = make_texture(GL_TEXTURE_3D, GL_R16I, n[0], n[1], n[2]);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage3D(made->scan_hu_.id(), 0, 0, 0, 0, n[0], n[1], n[2], GL_RED_INTEGER, GL_SHORT, volume.hu.data());
  made->lit_ = make_texture(GL_TEXTURE_3D, GL_RG8, n[0], n[1], n[2]);
  for (const GLenum filter : {GLenum{GL_TEXTURE_MIN_FILTER}, GLenum{GL_TEXTURE_MAG_FILTER}})
    glTextureParameteri(made->lit_.id(), filter, GL_LINEAR);
  int bricks[3];
  for (std::size_t axis = 0; axis < 3; ++axis) bricks[axis] = std::max(1, (n[axis] - 1 + kBrick - 1) / kBrick);
  for (GlTexture& texture : made->bricks_)
    texture = make_texture(GL_TEXTURE_3D, GL_R8UI, bricks[0], bricks[1], bricks[2]);
  std::vector<std::int32_t> seen_up_to{0};
  for (int hu = TransferFunction::kLowestHu; hu <= TransferFunction::kHighestHu; ++hu) {
    seen_up_to.push_back(seen_up_to.back() + (!prune || transfer.at(hu).extinction_per_mm > 0 ? 1 : 0));
  }
  made->seen_up_to_ = make_buffer(static_cast<GLsizeiptr>(seen_up_to.size() * sizeof(std::int32_t)), seen_up_to.data());
  made->transfer_table_ = make_texture(GL_TEXTURE_2D, GL_RGBA32F, 64, kEntries / 64, 1);
  GLuint id = 0;
  glCreateFramebuffers(1, &id);
  made->framebuffer_ = GlFramebuffer(id);
  glCreateVertexArrays(1, &id);
  made->no_vertices_ = GlVertexArray(id);
  made->find_bricks();
  return made;
}

void GlRayCaster::deform(const DisplacementField& field) {
  const auto& n = volume_.size;
  if (warped_hu_.id() == 0) warped_hu_ = make_texture(GL_TEXTURE_3D, GL_R16I, n[0], n[1], n[2]);
  const Eigen::Matrix3f voxel_from_patient = volume_.patient_from_voxel.linear().inverse().cast<float>();
  std::vector<Eigen::Vector4f> moves;
  moves.reserve(field.displacement_mm.size());
  for (const Eigen::Vector3f& u : field.displacement_mm) moves.emplace_back((voxel_from_patient * u).homogeneous());
  const GlTexture texture = make_texture(GL_TEXTURE_3D, GL_RGBA32F, field.size[0], field.size[1], field.size[2]);
  glTextureSubImage3D(texture.id(), 0, 0, 0, 0, field.size[0], field.size[1], field.size[2], GL_RGBA, GL_FLOAT,
                      moves.data());
  set(warp_, "lattice_from_voxel", Eigen::Affine3d(field.patient_from_lattice.inverse() * volume_.patient_from_voxel));
  glBindTextureUnit(0, scan_hu_.id());
  glBindTextureUnit(1, texture.id());
  glBindImageTexture(0, warped_hu_.id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_R16I);
  dispatch(warp_, n.data(), 8, 4, 4);
  deformed_ = true;
  find_bricks();
}

void GlRayCaster::undeform() {
  if (!deformed_) return;
  deformed_ = false;
  find_bricks();
}

void GlRayCaster::find_bricks() {
  int bricks[3];
  for (std::size_t axis = 0; axis < 3; ++axis)
    bricks[axis] = std::max(1, (volume_.size[axis] - 1 + kBrick - 1) / kBrick);
  glBindTextureUnit(0, deformed_ ? warped_hu_.id() : scan_hu_.id());
  glBindImageTexture(0, bricks_[0].id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_R8UI);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, seen_up_to_.id());
  dispatch(seen_, bricks, 4, 4, 4);
  for (int step = 0; step < kLeaps; ++step) {
    glBindTextureUnit(0, bricks_[0].id());
    glBindImageTexture(0, bricks_[1].id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_R8UI);
    dispatch(grow_, bricks, 4, 4, 4);
    std::swap(bricks_[0], bricks_[1]);
  }
}

void GlRayCaster::prepare(const CameraModel& camera) {
  const int width = camera.width_px;
  const int height = camera.height_px;
  std::vector<Eigen::Vector4f> rays(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                                    Eigen::Vector4f::Zero());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (const auto ray = unproject(camera, Eigen::Vector2d(x, y))) {
        rays[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)].head<3>() =
            ray->normalized().cast<float>();
      }
    }
  }
  directions_ = make_texture(GL_TEXTURE_2D, GL_RGBA32F, width, height, 1);
  glTextureSubImage2D(directions_.id(), 0, 0, 0, width, height, GL_RGBA, GL_FLOAT, rays.data());
  target_ = make_texture(GL_TEXTURE_2D, GL_RGBA8, width, height, 1);
  glNamedFramebufferTexture(framebuffer_.id(), GL_COLOR_ATTACHMENT0, target_.id(), 0);
  prepared_ = camera;
}

ImageRgba GlRayCaster::render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                              const RenderSettings& settings) {
  if (!(camera == prepared_)) prepare(camera);
  const Transform<Patient, Camera> patient_from_camera = camera_from_patient.inverse();
  const Eigen::Vector3d& eye = patient_from_camera.translation();
  const Eigen::Affine3d voxel_from_patient = volume_.patient_from_voxel.inverse();
  const GLuint hu = deformed_ ? warped_hu_.id() : scan_hu_.id();

  set(light_, "patient_from_voxel", volume_.patient_from_voxel);
  set(light_, "patient_gradient", Eigen::Matrix3d(voxel_from_patient.linear().transpose()));
  set(light_, "eye", eye);
  set(light_, "lamp", Eigen::Vector4d(settings.ambient, settings.diffuse, settings.specular, settings.shininess));
  set(light_, "per_surface_gradient", 1 / settings.surface_gradient_hu_per_mm);
  glBindTextureUnit(0, hu);
  glBindImageTexture(0, lit_.id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RG8);
  dispatch(light_, volume_.size.data(), 8, 4, 4);

  std::vector<Eigen::Vector4f> table;
  table.reserve(kEntries);
  for (int at = TransferFunction::kLowestHu; at <= TransferFunction::kHighestHu; ++at) {
    const TransferFunction::Entry& entry = transfer_.at(at);
    const auto extinction = static_cast<double>(entry.extinction_per_mm);
    table.emplace_back(entry.r, entry.g, entry.b, static_cast<float>(1 - std::exp(-extinction * settings.step_mm)));
  }
  glTextureSubImage2D(transfer_table_.id(), 0, 0, 0, 64, kEntries / 64, GL_RGBA, GL_FLOAT, table.data());

  set(cast_, "origin", Eigen::Vector3d(voxel_from_patient * eye));
  set(cast_, "voxels_from_camera", Eigen::Matrix3d(voxel_from_patient.linear() * patient_from_camera.rotation()));
  Eigen::Vector4d clip = Eigen::Vector4d::Zero();
  if (settings.clip) {
    clip.head<3>() = patient_from_camera.rotation().transpose() * settings.clip->normal;
    clip[3] = settings.clip->normal.dot(eye) - settings.clip->offset_mm;
  }
  set(cast_, "clip", clip);
  set(cast_, "near_mm", settings.near_mm);
  set(cast_, "step_mm", settings.step_mm);
  glProgramUniform1i(cast_.id(), place(cast_, "leaps"), kLeaps);
  const GLuint textures[] = {hu, lit_.id(), bricks_[0].id(), directions_.id(), transfer_table_.id()};
  glBindTextures(0, 5, textures);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, camera.width_px, camera.height_px);
  glDisable(GL_BLEND);
  glBindVertexArray(no_vertices_.id());
  glUseProgram(cast_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);

  return read_picture(camera.width_px, camera.height_px);
}

}  // namespace birdseye::host
