#include "render_client/page/browser/webgl_context.h"

#include <emscripten/html5.h>

#include "render_client/draw/gl_functions.h"

namespace sectio {

namespace {

class Context final : public WebglContext {
 public:
  Context(EMSCRIPTEN_WEBGL_CONTEXT_HANDLE handle, int width_px, int height_px) : handle_(handle) {
    Context::resize(width_px, height_px);
  }
  void make_current() override { emscripten_webgl_make_context_current(handle_); }
  const GlFunctions& functions() const override { return functions_; }
  Image& picture() override { return picture_; }
  void resize(int width_px, int height_px) override {
    picture_.width_px = width_px;
    picture_.height_px = height_px;
    emscripten_set_canvas_element_size("#canvas", width_px, height_px);
  }
  GlTarget target() override { return target_.value_or(WebglContext::target()); }
  void aim(const std::optional<GlTarget>& target) override { target_ = target; }

 private:
  EMSCRIPTEN_WEBGL_CONTEXT_HANDLE handle_;
  std::optional<GlTarget> target_;
  const GlFunctions functions_;
  Image picture_;  // without pixels: they stay in the browser
};

}  // namespace

std::unique_ptr<WebglContext> make_webgl_context(int width_px, int height_px) {
  EmscriptenWebGLContextAttributes wish;
  emscripten_webgl_init_context_attributes(&wish);
  wish.majorVersion = 2;
  wish.alpha = false;
  wish.antialias = true;
  wish.preserveDrawingBuffer = true;  // for pictures of the canvas
  const EMSCRIPTEN_WEBGL_CONTEXT_HANDLE handle = emscripten_webgl_create_context("#canvas", &wish);
  if (handle <= 0) return nullptr;
  return std::make_unique<Context>(handle, width_px, height_px);
}

}  // namespace sectio
