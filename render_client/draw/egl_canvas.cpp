// The same canvas in a context of EGL without a display: on a graphics card, else in llvmpipe.
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstdlib>
#include <string>

#include "common/core/error.h"
#include "common/core/log.h"
#include "render_client/draw/gl_canvas.h"
#include "render_client/draw/gl_functions.h"

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
      functions_ = std::make_unique<GlFunctions>(eglGetProcAddress);
      log_info("EGL draws by " + std::string(reinterpret_cast<const char*>(functions_->GetString(GL_RENDERER))));
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
  const GlFunctions& functions() const override { return *functions_; }
  Image& picture() override { return picture_; }
  void finish(const GlTarget& part) override { read_pixels(*functions_, part, picture_); }

 private:
  void release() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (surface_ != EGL_NO_SURFACE) eglDestroySurface(display_, surface_);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
  }

  Image picture_;
  std::unique_ptr<GlFunctions> functions_;
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
