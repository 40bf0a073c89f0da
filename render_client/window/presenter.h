// How a window comes to its pixels: the picture, and ImGui's widgets over it.
#pragma once

#include <memory>

#include "render_client/draw/canvas.h"
#include "render_client/draw/image.h"

struct SDL_Window;
struct ImDrawData;

namespace sectio {

class Presenter {
 public:
  virtual ~Presenter() = default;
  // Called before the first picture after the window may have changed its size.
  virtual void fit() {}
  // Whether the next pictures must lie in memory, too.
  virtual void want_pixels(bool) {}
  virtual void show(const Image& image, ImDrawData& widgets) = 0;
};

// Copies pictures from memory, without OpenGL, as large as the window allows; the rest is black.
std::unique_ptr<Presenter> make_software_presenter(SDL_Window& window);

// The window has OpenGL 3.3, and the canvas draws into it, as large as the window is. The presenter goes first. Throws
// InputError when there is no such OpenGL.
struct OpenGlPresenter {
  std::unique_ptr<Presenter> presenter;
  std::unique_ptr<Canvas> canvas;
};
void ask_for_opengl();  // before the window is made
OpenGlPresenter make_opengl_presenter(SDL_Window& window, int samples_per_pixel);

}  // namespace sectio
