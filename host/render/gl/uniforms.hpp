#pragma once

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "host/render/gl/gl_objects.hpp"

namespace birdseye::host {

inline GLint place(const GlProgram& program, const char* name) {
  return glGetUniformLocation(program.id(), name);
}

inline void set(const GlProgram& program, const char* name, const Eigen::Affine3d& m) {
  const Eigen::Matrix4f columns = m.matrix().cast<float>();
  glProgramUniformMatrix4fv(program.id(), place(program, name), 1, GL_FALSE, columns.data());
}
inline void set(const GlProgram& program, const char* name, const Eigen::Matrix3d& m) {
  const Eigen::Matrix3f columns = m.cast<float>();
  glProgramUniformMatrix3fv(program.id(), place(program, name), 1, GL_FALSE, columns.data());
}
inline void set(const GlProgram& program, const char* name, const Eigen::Vector2d& v) {
  glProgramUniform2f(program.id(), place(program, name), static_cast<float>(v.x()), static_cast<float>(v.y()));
}
inline void set(const GlProgram& program, const char* name, const Eigen::Vector3d& v) {
  const Eigen::Vector3f f = v.cast<float>();
  glProgramUniform3fv(program.id(), place(program, name), 1, f.data());
}
inline void set(const GlProgram& program, const char* name, const Eigen::Vector4d& v) {
  const Eigen::Vector4f f = v.cast<float>();
  glProgramUniform4fv(program.id(), place(program, name), 1, f.data());
}
inline void set(const GlProgram& program, const char* name, double value) {
  glProgramUniform1f(program.id(), place(program, name), static_cast<float>(value));
}

/// Runs a compute shader over so many invocations along each axis, and waits for what it writes to be seen.
inline void dispatch(const GlProgram& program, const int* size, int x, int y, int z) {
  const auto groups = [](int count, int of) { return static_cast<GLuint>((count + of - 1) / of); };
  glUseProgram(program.id());
  glDispatchCompute(groups(size[0], x), groups(size[1], y), groups(size[2], z));
  glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
}

}  // namespace birdseye::host
