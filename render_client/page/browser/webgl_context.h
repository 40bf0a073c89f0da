// WebGL 2 on the page's canvas.
#pragma once

#include <memory>
#include <optional>

#include "render_client/draw/gl_canvas.h"

namespace sectio {

class WebglContext : public GlContext {
 public:
  virtual void resize(int width_px, int height_px) = 0;
  // Pictures go into this part of a framebuffer that the script has made known; without a value, onto the canvas.
  virtual void aim(const std::optional<GlTarget>& target) = 0;
};

// On the element #canvas. Null when the browser has no WebGL 2.
std::unique_ptr<WebglContext> make_webgl_context(int width_px, int height_px);

}  // namespace sectio
