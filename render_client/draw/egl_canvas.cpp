// The same canvas in a context of EGL without a display: on a graphics card whose driver is Mesa's, else in llvmpipe.
// The gl* functions are libOSMesa's: they go to whichever context of Mesa is current.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>

#include <array>
#include <cstdlib>
#include <string>

#include "common/core/error.h"
#include "common/core/log.h"
#include "render_client/draw/gl_canvas.h"

namespace sectio {

namespace {

class EglContext final : public GlContext {
 public:
  EglContext(int width_px, int height_px) : picture_(width_px, height_px) {
    setenv("LP_NUM_THREADS", "1", 0);
    display_ = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    if (display_ == EGL_NO_DISPLAY || !eglInitialize(display_, nullptr, nullptr) || !eglBindAPI(EGL_OPENGL_API))
      throw InputError("EGL can't be used without a display here; OSMesa's canvas draws in software");
    constexpr std::array<EGLint, 15> kWish{EGL_SURFACE_TYPE,
                                           EGL_PBUFFER_BIT,
                                           EGL_RENDERABLE_TYPE,
                                           EGL_OPENGL_BIT,
                                           EGL_RED_SIZE,
                                           8,
                                           EGL_GREEN_SIZE,
                                           8,
                                           EGL_BLUE_SIZE,
                                           8,
                                           EGL_ALPHA_SIZE,
                                           8,
                                           EGL_DEPTH_SIZE,
                                           24,
                                           EGL_NONE};
    constexpr std::array<EGLint, 7> kVersion{
        EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    const std::array<EGLint, 5> size{EGL_WIDTH, width_px, EGL_HEIGHT, height_px, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint found = 0;
    if (!eglChooseConfig(display_, kWish.data(), &config, 1, &found) || found == 0)
      throw InputError("EGL has no pictures of 8 bits with a depth of 24");
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, kVersion.data());
    surface_ = eglCreatePbufferSurface(display_, config, size.data());
    try {
      if (context_ == EGL_NO_CONTEXT || surface_ == EGL_NO_SURFACE)
        throw InputError("EGL can't make an OpenGL 3.3 core context with a picture of " + std::to_string(width_px) +
                         " x " + std::to_string(height_px) + " pixels");
      EglContext::make_current();
      const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
      if (!renderer) throw InputError("EGL is of another maker than Mesa: its functions can't be called here");
      log_info("EGL draws by " + std::string(renderer));
    } catch (...) {
      release();
      throw;
    }
  }
  ~EglContext() override { release(); }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  void make_current() override {
    if (eglGetCurrentContext() == context_) return;
    if (!eglMakeCurrent(display_, surface_, surface_, context_)) throw InputError("EGL can't use its own context");
  }
  Image& picture() override { return picture_; }
  void finish() override {
    const auto width = static_cast<std::size_t>(picture_.width_px);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    for (int y = 0; y < picture_.height_px; ++y)  // theirs has its last row first
      glReadPixels(0, picture_.height_px - 1 - y, picture_.width_px, 1, GL_RGBA, GL_UNSIGNED_BYTE,
                   picture_.rgba.data() + 4 * width * static_cast<std::size_t>(y));
  }

 private:
  void release() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (surface_ != EGL_NO_SURFACE) eglDestroySurface(display_, surface_);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
  }

  Image picture_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  ::EGLContext context_ = EGL_NO_CONTEXT;
  EGLSurface surface_ = EGL_NO_SURFACE;
};

}  // namespace

std::unique_ptr<Canvas> make_egl_canvas(int width_px, int height_px, int samples_per_pixel) {
  check_canvas(width_px, height_px, samples_per_pixel);
  return make_gl_canvas(std::make_unique<EglContext>(width_px, height_px), samples_per_pixel);
}

}  // namespace sectio
