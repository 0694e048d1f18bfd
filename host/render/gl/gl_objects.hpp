#pragma once

#include <epoxy/gl.h>

#include <array>
#include <initializer_list>
#include <string>
#include <utility>

#include "calibration/base/result.hpp"
#include "host/render/scene/scene.hpp"

namespace birdseye::host {

/// Owns one OpenGL object; Delete ends it.
template <typename Delete>
class GlObject {
 public:
  GlObject() = default;
  explicit GlObject(GLuint id) : id_(id) {}
  GlObject(GlObject&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~GlObject() {
    if (id_ != 0) Delete()(id_);
  }
  [[nodiscard]] GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

struct DeleteTexture {
  void operator()(GLuint id) const { glDeleteTextures(1, &id); }
};
struct DeleteBuffer {
  void operator()(GLuint id) const { glDeleteBuffers(1, &id); }
};
struct DeleteFramebuffer {
  void operator()(GLuint id) const { glDeleteFramebuffers(1, &id); }
};
struct DeleteVertexArray {
  void operator()(GLuint id) const { glDeleteVertexArrays(1, &id); }
};
struct DeleteProgram {
  void operator()(GLuint id) const { glDeleteProgram(id); }
};
using GlTexture = GlObject<DeleteTexture>;
using GlBuffer = GlObject<DeleteBuffer>;
using GlFramebuffer = GlObject<DeleteFramebuffer>;
using GlVertexArray = GlObject<DeleteVertexArray>;
using GlProgram = GlObject<DeleteProgram>;

/// Compiles and links. A failure is a bug of ours; the error carries the compiler's words.
Result<GlProgram> make_program(std::initializer_list<std::pair<GLenum, std::string>> shaders);
/// A texture of one level, with nearest sampling, clamped at its borders.
GlTexture make_texture(GLenum target, GLenum format, GLsizei width, GLsizei height, GLsizei depth);
/// Errc::unsupported where the driver has no textures of a volume's size.
Result<void> check_texture_size(const std::array<int, 3>& size);
/// Reads the bound framebuffer as 8 bits; row 0 of the picture is the card's first row.
ImageRgba read_picture(int width_px, int height_px);
GlBuffer make_buffer(GLsizeiptr bytes, const void* data);

}  // namespace birdseye::host
