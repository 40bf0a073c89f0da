// The software canvas: OpenGL 3.3 core in Mesa's llvmpipe, drawn into the picture's own memory.
#include <array>
#include <cstdlib>
#include <string>

#include "common/core/error.h"
#include "common/core/log.h"
#include "render_client/draw/gl_canvas.h"
#include "render_client/draw/gl_functions.h"

namespace sectio {

namespace {

class OsmesaContext final : public GlContext {
 public:
  OsmesaContext(int width_px, int height_px) : picture_(width_px, height_px) {
    setenv("LP_NUM_THREADS", "1", 0);
    const std::array attributes{OSMESA_FORMAT,
                                OSMESA_RGBA,
                                OSMESA_DEPTH_BITS,
                                24,
                                OSMESA_PROFILE,
                                OSMESA_CORE_PROFILE,
                                OSMESA_CONTEXT_MAJOR_VERSION,
                                3,
                                OSMESA_CONTEXT_MINOR_VERSION,
                                3,
                                0};
    context_ = OSMesaCreateContextAttribs(attributes.data(), nullptr);
    if (!context_) throw InputError("OSMesa can't make an OpenGL 3.3 core context");
    try {
      OsmesaContext::make_current();
    } catch (...) {
      OSMesaDestroyContext(context_);
      throw;
    }
    const std::string renderer = reinterpret_cast<const char*>(functions_.GetString(GL_RENDERER));
    if (renderer.find("llvmpipe") == std::string::npos)
      log_warning("OpenGL is drawn by " + renderer + ", not by llvmpipe: expect few frames per second");
  }
  ~OsmesaContext() override { OSMesaDestroyContext(context_); }
  OsmesaContext(const OsmesaContext&) = delete;
  OsmesaContext& operator=(const OsmesaContext&) = delete;

  void make_current() override {
    if (OSMesaGetCurrentContext() == context_) return;
    if (!OSMesaMakeCurrent(context_, picture_.rgba.data(), GL_UNSIGNED_BYTE, picture_.width_px, picture_.height_px)) {
      throw InputError("OSMesa can't draw a picture of " + std::to_string(picture_.width_px) + " x " +
                       std::to_string(picture_.height_px) + " pixels");
    }
    OSMesaPixelStore(OSMESA_Y_UP, 0);
  }
  const GlFunctions& functions() const override { return functions_; }
  Image& picture() override { return picture_; }

 private:
  Image picture_;
  const GlFunctions functions_{OSMesaGetProcAddress};
  OSMesaContext context_ = nullptr;
};

}  // namespace

void check_canvas(int width_px, int height_px, int samples_per_pixel) {
  constexpr int kMaxSize_px = 16384;
  if (width_px < 1 || height_px < 1 || width_px > kMaxSize_px || height_px > kMaxSize_px) {
    throw InputError("picture size " + std::to_string(width_px) + " x " + std::to_string(height_px) +
                     ": expected 1 to " + std::to_string(kMaxSize_px) + " pixels");
  }
  if (samples_per_pixel != 1 && samples_per_pixel != 4) {
    throw InputError("samples per pixel: expected 1 or 4, got " + std::to_string(samples_per_pixel));
  }
}

std::unique_ptr<Canvas> make_osmesa_canvas(int width_px, int height_px, int samples_per_pixel) {
  check_canvas(width_px, height_px, samples_per_pixel);
  return make_gl_canvas(std::make_unique<OsmesaContext>(width_px, height_px), samples_per_pixel);
}

}  // namespace sectio
