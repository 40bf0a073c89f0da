#include "render_client/window/window.h"

#include <SDL2/SDL.h>

#include <cmath>

#include "common/core/error.h"

namespace sectio {

namespace {

constexpr double kTurn_rad = 4;  // by a drag over the height of the window
constexpr double kSectionStep_m = 0.002;
constexpr double kZoom = 0.12;  // logarithm of the distance, for a notch of the wheel

}  // namespace

struct Window::State {
  SDL_Window* window = nullptr;
  SDL_Renderer* renderer = nullptr;
  SDL_Texture* texture = nullptr;
  int texture_width_px = 0, texture_height_px = 0;
  bool full_screen = false;

  ~State() {
    if (texture) SDL_DestroyTexture(texture);
    if (renderer) SDL_DestroyRenderer(renderer);
    if (window) SDL_DestroyWindow(window);
    SDL_QuitSubSystem(SDL_INIT_VIDEO);
  }
  void set_full_screen(bool on) {
    full_screen = on;
    SDL_SetWindowFullscreen(window, on ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0);
  }
  void press(SDL_Keycode key, WindowInput& input) const;
  void drag(const SDL_MouseMotionEvent& motion, WindowInput& input) const;
};

Window::Window(const WindowOptions& options) {
  // Ctrl-C stays the program's own.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "linear");
  // Another library of OpenGL beside OSMesa's takes its functions away.
  SDL_SetHint(SDL_HINT_FRAMEBUFFER_ACCELERATION, "0");
  if (SDL_InitSubSystem(SDL_INIT_VIDEO) != 0)
    throw InputError(std::string("--window: there is no display: ") + SDL_GetError());
  state_ = std::make_unique<State>();
  State& s = *state_;
  const int displays = SDL_GetNumVideoDisplays();
  if (options.display < 0 || options.display >= displays)
    throw InputError("--display: expected 0 to " + std::to_string(displays - 1) + ", got " +
                     std::to_string(options.display));
  const int place = static_cast<int>(SDL_WINDOWPOS_CENTERED_DISPLAY(static_cast<unsigned>(options.display)));
  s.window =
      SDL_CreateWindow(options.title.c_str(), place, place, options.width_px, options.height_px, SDL_WINDOW_RESIZABLE);
  if (s.window) s.renderer = SDL_CreateRenderer(s.window, -1, SDL_RENDERER_SOFTWARE);
  if (!s.renderer) throw InputError(std::string("--window: no window can be opened: ") + SDL_GetError());
  if (options.full_screen) s.set_full_screen(true);
}

Window::~Window() = default;

void Window::State::press(SDL_Keycode key, WindowInput& input) const {
  if (key >= SDLK_1 && key <= SDLK_9) input.follows = static_cast<std::size_t>(key - SDLK_1);
  if (key == SDLK_SPACE) input.halts = !input.halts;
  if (key == SDLK_w) input.wireframe = !input.wireframe;
  if (key == SDLK_c) input.section = !input.section;
  if (key == SDLK_PAGEUP) input.section_nearer_m -= kSectionStep_m;
  if (key == SDLK_PAGEDOWN) input.section_nearer_m += kSectionStep_m;
  if (key == SDLK_f) input.full_screen = !input.full_screen;
  if (key == SDLK_p) input.keeps_picture = true;
  if (key == SDLK_HOME) input.home = true;
  if (key == SDLK_ESCAPE) input.closes = true;
}

void Window::State::drag(const SDL_MouseMotionEvent& motion, WindowInput& input) const {
  int width_px = 1, height_px = 1;
  SDL_GetWindowSize(window, &width_px, &height_px);
  const double right = static_cast<double>(motion.xrel) / height_px,
               down = static_cast<double>(motion.yrel) / height_px;
  const bool moves = (motion.state & SDL_BUTTON_RMASK) != 0 || (SDL_GetModState() & KMOD_SHIFT) != 0;
  if (moves) {
    input.move_right += right;
    input.move_up -= down;
  } else {
    input.turn_right_rad += kTurn_rad * right;
    input.turn_up_rad += kTurn_rad * down;
  }
}

WindowInput Window::input() {
  WindowInput input;
  for (SDL_Event event; SDL_PollEvent(&event) != 0;) {
    if (event.type == SDL_QUIT) input.closes = true;
    if (event.type == SDL_KEYDOWN &&
        (event.key.repeat == 0 || event.key.keysym.sym == SDLK_PAGEUP || event.key.keysym.sym == SDLK_PAGEDOWN))
      state_->press(event.key.keysym.sym, input);
    if (event.type == SDL_MOUSEWHEEL) input.nearer *= std::exp(-kZoom * event.wheel.y);
    if (event.type == SDL_MOUSEMOTION && event.motion.state != 0) state_->drag(event.motion, input);
  }
  if (input.full_screen) state_->set_full_screen(!state_->full_screen);
  return input;
}

void Window::show(const Image& image) {
  State& s = *state_;
  if (s.texture && (s.texture_width_px != image.width_px || s.texture_height_px != image.height_px)) {
    SDL_DestroyTexture(s.texture);
    s.texture = nullptr;
  }
  if (!s.texture) {
    s.texture = SDL_CreateTexture(s.renderer, SDL_PIXELFORMAT_RGBA32, SDL_TEXTUREACCESS_STREAMING, image.width_px,
                                  image.height_px);
    s.texture_width_px = image.width_px;
    s.texture_height_px = image.height_px;
    SDL_RenderSetLogicalSize(s.renderer, image.width_px, image.height_px);
  }
  SDL_UpdateTexture(s.texture, nullptr, image.rgba.data(), 4 * image.width_px);
  SDL_RenderClear(s.renderer);
  SDL_RenderCopy(s.renderer, s.texture, nullptr, nullptr);
  SDL_RenderPresent(s.renderer);
}

const char* Window::help() {
  return "drag: turn; right button or Shift: move; wheel: nearer; 1 to 9: follow an instrument; Space: halt the "
         "picture; "
         "W: wireframe; C: section, which PageUp and PageDown move; P: keep a picture; F: full screen; Home: first "
         "view; Escape: end";
}

}  // namespace sectio
