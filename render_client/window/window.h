// A window on a desktop that shows pictures and tells what the person at it does. The thread that makes it uses it.
#pragma once

#include <memory>
#include <string>

#include "render_client/draw/canvas.h"
#include "render_client/draw/image.h"
#include "render_client/window/panel.h"
#include "render_client/window/viewpoint.h"

namespace sectio {

struct WindowOptions {
  std::string title = "Sectio";
  int width_px = 1280, height_px = 720;
  int display = 0;  // on which the window opens, from 0
  bool full_screen = false;
  bool opengl = false;        // a canvas draws in the window itself
  int samples_per_pixel = 1;  // on that canvas
};

class Window {
 public:
  // Throws InputError when there is no such display, or none at all.
  explicit Window(const WindowOptions& options);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  // Only with `opengl`. Its pictures are as large as the window, and have no pixels in memory unless they are wanted.
  Canvas* canvas();
  void want_pixels(bool wanted);

  // Tells all that the person did since the last call, at the panel, too.
  WindowInput input();
  // The picture, with the panel over it if there is one; the window itself adds what it knows. Without `opengl`, the
  // picture gets as large as the window allows, and the rest is black.
  void show(const Image& image, const PanelView* panel);

  // The keys and buttons, in a line for a person.
  static const char* help();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
