#include "host/render/gl/gl_context.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdlib>

namespace birdseye::host {

namespace {

Error missing(const std::string& what) {
  return {Errc::unsupported, "OpenGL: " + what + "; install libegl1 and libgl1-mesa-dri, or use --engine cpu"};
}

void note(GLenum /*source*/, GLenum type, GLuint /*id*/, GLenum severity, GLsizei /*length*/, const GLchar* message,
          const void* fault) {
  if (type != GL_DEBUG_TYPE_ERROR && severity != GL_DEBUG_SEVERITY_HIGH) return;
  auto* const first = static_cast<std::string*>(const_cast<void*>(fault));
  if (first->empty()) *first = message;
}

class Surfaceless final : public GlContext {
 public:
  Surfaceless() = default;
  ~Surfaceless() override;
  Surfaceless(const Surfaceless&) = delete;
  Surfaceless& operator=(const Surfaceless&) = delete;
  Result<void> open();

 private:
  EGLDisplay display_ = nullptr;
  EGLContext context_ = nullptr;
};

Result<void> Surfaceless::open() {
  // epoxy ends the program where there is no EGL to load.
  if (::dlopen("libEGL.so.1", RTLD_LAZY) == nullptr) return missing("no libEGL.so.1");
  hush_drivers();
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless") ||
      !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) {
    return missing("no EGL with a surfaceless platform");
  }
  EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == EGL_FALSE) {
    return missing("EGL finds no driver");
  }
  display_ = display;
  if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) return missing("EGL has OpenGL ES only");
  constexpr std::array<EGLint, 5> kConfig{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  eglChooseConfig(display, kConfig.data(), &config, 1, &count);
  constexpr std::array<EGLint, 9> kContext{EGL_CONTEXT_MAJOR_VERSION,
                                           4,
                                           EGL_CONTEXT_MINOR_VERSION,
                                           5,
                                           EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                           EGL_CONTEXT_OPENGL_DEBUG,
                                           EGL_TRUE,
                                           EGL_NONE};
  context_ = count > 0 ? eglCreateContext(display, config, EGL_NO_CONTEXT, kContext.data()) : EGL_NO_CONTEXT;
  if (context_ == EGL_NO_CONTEXT) return missing("the driver has no OpenGL 4.5 core");
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE) {
    return missing("the driver needs a window");
  }
  begin();
  return {};
}

Surfaceless::~Surfaceless() {
  if (display_ == nullptr) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  if (context_ != nullptr) eglDestroyContext(display_, context_);
  eglTerminate(display_);
}

}  // namespace

Result<std::unique_ptr<GlContext>> GlContext::offscreen() {
  auto made = std::make_unique<Surfaceless>();
  if (auto opened = made->open(); !opened) return opened.error();
  return std::unique_ptr<GlContext>(std::move(made));
}

void GlContext::hush_drivers() {
  ::setenv("EGL_LOG_LEVEL", "fatal", 0);
}

void GlContext::begin() {
  renderer_ = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDebugMessageCallback(note, &fault_);
}

}  // namespace birdseye::host
