#include "host/render/gl/gl_objects.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace birdseye::host {

Result<GlProgram> make_program(std::initializer_list<std::pair<GLenum, std::string>> shaders) {
  GlProgram program(glCreateProgram());
  std::array<char, 2000> log{};
  for (const auto& [kind, text] : shaders) {
    const GLuint shader = glCreateShader(kind);
    const char* const source = text.c_str();
    glShaderSource(shader, 1, &source, nullptr);
    glCompileShader(shader);
    GLint compiled = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled == 0) glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glAttachShader(program.id(), shader);
    glDeleteShader(shader);
    if (compiled == 0) return Error{Errc::unsupported, std::string("OpenGL: a shader does not compile: ") + log.data()};
  }
  glLinkProgram(program.id());
  GLint linked = 0;
  glGetProgramiv(program.id(), GL_LINK_STATUS, &linked);
  if (linked == 0) {
    glGetProgramInfoLog(program.id(), static_cast<GLsizei>(log.size()), nullptr, log.data());
    return Error{Errc::unsupported, std::string("OpenGL: shaders do not link: ") + log.data()};
  }
  return program;
}

GlTexture make_texture(GLenum target, GLenum format, GLsizei width, GLsizei height, GLsizei depth) {
  GLuint id = 0;
  glCreateTextures(target, 1, &id);
  if (target == GL_TEXTURE_3D) {
    glTextureStorage3D(id, 1, format, width, height, depth);
  } else {
    glTextureStorage2D(id, 1, format, width, height);
  }
  for (const GLenum filter : {GLenum{GL_TEXTURE_MIN_FILTER}, GLenum{GL_TEXTURE_MAG_FILTER}})
    glTextureParameteri(id, filter, GL_NEAREST);
  for (const GLenum wrap : {GLenum{GL_TEXTURE_WRAP_S}, GLenum{GL_TEXTURE_WRAP_T}, GLenum{GL_TEXTURE_WRAP_R}}) {
    glTextureParameteri(id, wrap, GL_CLAMP_TO_EDGE);
  }
  return GlTexture(id);
}

Result<void> check_texture_size(const std::array<int, 3>& size) {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &largest);
  if (*std::max_element(size.begin(), size.end()) <= largest) return {};
  return Error{Errc::unsupported,
               fmt::format("OpenGL: a volume of {}x{}x{} is larger than this driver's textures, {} an axis; "
                           "use --engine cpu",
                           size[0], size[1], size[2], largest)};
}

ImageRgba read_picture(int width_px, int height_px) {
  ImageRgba image{width_px, height_px, {}};
  image.rgba.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 4);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_px, height_px, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
  return image;
}

GlBuffer make_buffer(GLsizeiptr bytes, const void* data) {
  GLuint id = 0;
  glCreateBuffers(1, &id);
  glNamedBufferStorage(id, bytes, data, GL_DYNAMIC_STORAGE_BIT);
  return GlBuffer(id);
}

}  // namespace birdseye::host
