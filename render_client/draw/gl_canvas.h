// A canvas that draws by OpenGL, in whatever context it is given.
#pragma once

#include <memory>

#include "render_client/draw/canvas.h"

namespace sectio {

// The part of a framebuffer that takes a picture; 0 is the context's own framebuffer.
struct GlTarget {
  unsigned framebuffer = 0;
  int left_px = 0, bottom_px = 0, width_px = 0, height_px = 0;
};

struct GlFunctions;

class GlContext {
 public:
  virtual ~GlContext() = default;
  virtual void make_current() = 0;
  virtual const GlFunctions& functions() const = 0;
  // The size of the context's own framebuffer; its pixels, too, where they lie in memory.
  virtual Image& picture() = 0;
  virtual GlTarget target() { return {0, 0, 0, picture().width_px, picture().height_px}; }
  // All has been drawn: brings the pixels of this part into the picture, where they lie elsewhere.
  virtual void finish(const GlTarget&) {}
};

// Reads a part of a framebuffer, whose last row is the picture's first, into the same part of the picture.
void read_pixels(const GlFunctions& gl, const GlTarget& part, Image& picture);

// Throws InputError for sizes and samples that no canvas can have.
void check_canvas(int width_px, int height_px, int samples_per_pixel);

// samples_per_pixel: see make_osmesa_canvas(). The size of the picture may change between two of them.
std::unique_ptr<Canvas> make_gl_canvas(std::unique_ptr<GlContext> context, int samples_per_pixel);

}  // namespace sectio
