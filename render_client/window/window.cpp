#include "render_client/window/window.h"

#include <SDL2/SDL.h>
#include <backends/imgui_impl_sdl.h>
#include <imgui.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "common/core/error.h"
#include "render_client/window/presenter.h"

namespace sectio {

namespace {

constexpr double kTurn_rad = 4;  // by a drag over the height of the window
constexpr double kSectionStep_m = 0.002;
constexpr const char* kFontFile = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr float kFontSize_px = 15;
constexpr double kZoom = 0.12;  // logarithm of the distance, for a notch of the wheel

}  // namespace

struct Window::State {
  SDL_Window* window = nullptr;
  OpenGlPresenter drawn;  // it has a canvas only if it draws by OpenGL
  bool full_screen = false;
  PanelShown panel;          // at the last picture
  bool drags_panel = false;  // the button went down there

  ~State() {
    drawn.presenter.reset();
    drawn.canvas.reset();
    if (ImGui::GetCurrentContext()) {
      if (ImGui::GetIO().BackendPlatformUserData) ImGui_ImplSDL2_Shutdown();
      ImGui::DestroyContext();
    }
    if (window) SDL_DestroyWindow(window);
    SDL_QuitSubSystem(SDL_INIT_VIDEO);
  }
  void set_full_screen(bool on) {
    full_screen = on;
    SDL_SetWindowFullscreen(window, on ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0);
  }
  // ImGui itself knows where the mouse was at the last picture, and events come in between.
  bool is_on_panel(int x_px, int y_px) const {
    const Rect& p = panel.place;
    return x_px >= p.x_px && y_px >= p.y_px && x_px < p.x_px + p.width_px && y_px < p.y_px + p.height_px;
  }
  void press(SDL_Keycode key, WindowInput& input) const;
  void drag(const SDL_MouseMotionEvent& motion, WindowInput& input) const;
};

Window::Window(const WindowOptions& options) {
  // Ctrl-C stays the program's own.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "linear");
  // A context of SDL's own would be current in place of OSMesa's.
  SDL_SetHint(SDL_HINT_FRAMEBUFFER_ACCELERATION, "0");
  if (SDL_InitSubSystem(SDL_INIT_VIDEO) != 0)
    throw InputError(std::string("--window: there is no display: ") + SDL_GetError());
  // Without a display SDL takes a driver that shows nothing, as if it had been asked for.
  const std::string driver = SDL_GetCurrentVideoDriver();
  if (!std::getenv("SDL_VIDEODRIVER") && (driver == "offscreen" || driver == "dummy")) {
    SDL_QuitSubSystem(SDL_INIT_VIDEO);
    throw InputError("--window: there is no display");
  }
  state_ = std::make_unique<State>();
  State& s = *state_;
  const int displays = SDL_GetNumVideoDisplays();
  if (options.display < 0 || options.display >= displays)
    throw InputError("--display: expected 0 to " + std::to_string(displays - 1) + ", got " +
                     std::to_string(options.display));
  const int place = static_cast<int>(SDL_WINDOWPOS_CENTERED_DISPLAY(static_cast<unsigned>(options.display)));
  if (options.opengl) ask_for_opengl();
  s.window = SDL_CreateWindow(options.title.c_str(), place, place, options.width_px, options.height_px,
                              options.opengl ? SDL_WINDOW_RESIZABLE | SDL_WINDOW_OPENGL : SDL_WINDOW_RESIZABLE);
  if (!s.window)
    throw InputError(std::string(options.opengl ? "--canvas window" : "--window") +
                     ": no window can be opened: " + SDL_GetError());
  if (options.full_screen) s.set_full_screen(true);
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  if (std::filesystem::exists(kFontFile)) ImGui::GetIO().Fonts->AddFontFromFileTTF(kFontFile, kFontSize_px);
  if (options.opengl)
    s.drawn = make_opengl_presenter(*s.window, options.samples_per_pixel);
  else
    s.drawn.presenter = make_software_presenter(*s.window);
  ImGui_ImplSDL2_InitForSDLRenderer(s.window);
}

Window::~Window() = default;

Canvas* Window::canvas() {
  return state_->drawn.canvas.get();
}

void Window::want_pixels(bool wanted) {
  state_->drawn.presenter->want_pixels(wanted);
}

void Window::State::press(SDL_Keycode key, WindowInput& input) const {
  if (key >= SDLK_1 && key <= SDLK_9) input.follows = static_cast<std::size_t>(key - SDLK_1);
  if (key == SDLK_SPACE) input.halts = !input.halts;
  if (key == SDLK_w) input.wireframe = !input.wireframe;
  if (key == SDLK_c) input.section = !input.section;
  if (key == SDLK_PAGEUP) input.section_nearer_m -= kSectionStep_m;
  if (key == SDLK_PAGEDOWN) input.section_nearer_m += kSectionStep_m;
  if (key == SDLK_f) input.full_screen = !input.full_screen;
  if (key == SDLK_s) input.stereo = !input.stereo;
  if (key == SDLK_h) input.panel = !input.panel;
  if (key == SDLK_v) input.next_field = true;
  if (key == SDLK_p) input.keeps_picture = true;
  if (key == SDLK_HOME) input.home = true;
  if (key == SDLK_ESCAPE) input.closes = true;
  if (key == SDLK_BACKSPACE) input.goes_back = true;
  if (key == SDLK_RETURN || key == SDLK_KP_ENTER) input.pauses = !input.pauses;
}

void Window::State::drag(const SDL_MouseMotionEvent& motion, WindowInput& input) const {
  int width_px = 1, height_px = 1;
  SDL_GetWindowSize(window, &width_px, &height_px);
  const double height = std::min<double>(height_px, width_px / kNarrowestAspect);
  const double right = motion.xrel / height, down = motion.yrel / height;
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
  WindowInput input = std::exchange(state_->panel.input, {});
  for (SDL_Event event; SDL_PollEvent(&event) != 0;) {
    ImGui_ImplSDL2_ProcessEvent(&event);
    if (event.type == SDL_QUIT) input.closes = true;
    if (event.type == SDL_KEYDOWN && !ImGui::GetIO().WantCaptureKeyboard &&
        (event.key.repeat == 0 || event.key.keysym.sym == SDLK_PAGEUP || event.key.keysym.sym == SDLK_PAGEDOWN))
      state_->press(event.key.keysym.sym, input);
    if (event.type == SDL_MOUSEBUTTONDOWN) state_->drags_panel = state_->is_on_panel(event.button.x, event.button.y);
    if (event.type == SDL_MOUSEWHEEL && !state_->is_on_panel(event.wheel.mouseX, event.wheel.mouseY))
      input.nearer *= std::exp(-kZoom * event.wheel.y);
    if (event.type == SDL_MOUSEMOTION && event.motion.state != 0 && !state_->drags_panel)
      state_->drag(event.motion, input);
  }
  if (input.full_screen) state_->set_full_screen(!state_->full_screen);
  state_->drawn.presenter->fit();
  return input;
}

void Window::show(const Image& image, const PanelView* panel) {
  ImGui_ImplSDL2_NewFrame();
  ImGui::NewFrame();
  state_->panel.place = {};
  if (panel) {
    PanelView view = *panel;
    view.pictures_per_s = static_cast<double>(ImGui::GetIO().Framerate);
    view.full_screen = state_->full_screen;
    const PanelShown shown = show_panel(view);
    state_->panel.place = shown.place;
    state_->panel.input.add(shown.input);
  }
  ImGui::Render();
  state_->drawn.presenter->show(image, *ImGui::GetDrawData());
}

const char* Window::help() {
  return "drag: turn; right button or Shift: move; wheel: nearer; 1 to 9: follow an instrument; Space: halt the "
         "picture; W: wireframe; C: section, which PageUp and PageDown move; V: colours; S: stereo; P: keep a picture; "
         "F: full screen; H: panel; Home: first view; Escape: end; with --lead, Enter: pause the session, Backspace: "
         "ten seconds back";
}

}  // namespace sectio
