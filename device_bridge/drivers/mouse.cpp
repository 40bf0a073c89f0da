#include "device_bridge/drivers/mouse.h"

#include <SDL2/SDL.h>

#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "common/core/error.h"
#include "common/core/latest_value.h"

namespace sectio {
namespace {

constexpr int kWidth_px = 480, kHeight_px = 320, kWait_ms = 20;
constexpr double kKeyTurn_rad = 0.1;
constexpr const char* kTitle = "Sectio: a mouse as a hand (Escape lets it go)";

// Sums since the window was opened.
struct MouseState {
  bool here = false;
  Vec3 way_m = Vec3::Zero(), turn_rad = Vec3::Zero();
  Buttons buttons;
};

// The window that has the pointer, with a thread of its own.
class MouseWindow {
 public:
  // Throws an InputError when no window can be opened.
  explicit MouseWindow(const MouseSpec& spec) : spec_(spec) {
    thread_ = std::thread([this] { run(); });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return tried_; });
    if (trouble_.empty()) return;
    lock.unlock();
    end();
    throw InputError("--device mouse: no window can be opened: " + trouble_);
  }
  ~MouseWindow() { end(); }

  // False: nothing has changed.
  bool latest(MouseState& state) { return states_.load(state); }

 private:
  void end() {
    stop_ = true;
    thread_.join();
  }
  void run() {
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
    SDL_Window* window = nullptr;
    const bool begun = SDL_InitSubSystem(SDL_INIT_VIDEO) == 0;
    // Without a desktop SDL takes a driver that shows nothing, as if it had been asked for.
    const std::string driver = begun ? SDL_GetCurrentVideoDriver() : "";
    const bool shows_nothing = (driver == "offscreen" || driver == "dummy") && !std::getenv("SDL_VIDEODRIVER");
    if (begun && !shows_nothing)
      window = SDL_CreateWindow(kTitle, SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, kWidth_px, kHeight_px, 0);
    MouseState state;
    state.here = window != nullptr;
    states_.store(state);
    {
      const std::lock_guard lock(mutex_);
      tried_ = true;
      if (!window) trouble_ = shows_nothing ? "there is no display" : SDL_GetError();
    }
    changed_.notify_all();
    while (window && !stop_ && state.here) {
      SDL_Event event;
      if (!SDL_WaitEventTimeout(&event, kWait_ms)) continue;
      take(event, state);
      states_.store(state);
    }
    if (window) SDL_DestroyWindow(window);
    if (begun) SDL_QuitSubSystem(SDL_INIT_VIDEO);
  }

  void take(const SDL_Event& event, MouseState& state) const {
    switch (event.type) {
      case SDL_QUIT:
        state.here = false;
        return;
      case SDL_MOUSEBUTTONDOWN:
        SDL_SetRelativeMouseMode(SDL_TRUE);  // the pointer doesn't leave the window while it is a hand
        break;
      case SDL_MOUSEMOTION: {
        const double right_m = spec_.way_m_per_count * event.motion.xrel,
                     away_m = -spec_.way_m_per_count * event.motion.yrel;
        const bool lifts = (event.motion.state & SDL_BUTTON_LMASK) != 0;
        state.way_m += lifts ? Vec3(right_m, 0, away_m) : Vec3(right_m, away_m, 0);
        return;
      }
      case SDL_MOUSEWHEEL:
        state.way_m.z() += spec_.wheel_m * event.wheel.y;
        return;
      case SDL_KEYDOWN:
        press(event.key.keysym.sym, state);
        break;
      default:
        break;
    }
    state.buttons = {(SDL_GetModState() & KMOD_SHIFT) != 0,
                     (SDL_GetMouseState(nullptr, nullptr) & SDL_BUTTON_RMASK) != 0};
  }

  static void press(SDL_Keycode key, MouseState& state) {
    if (key == SDLK_ESCAPE) SDL_SetRelativeMouseMode(SDL_FALSE);
    if (key == SDLK_q || key == SDLK_e) state.turn_rad.z() += key == SDLK_q ? kKeyTurn_rad : -kKeyTurn_rad;
    if (key == SDLK_r || key == SDLK_f) state.turn_rad.y() += key == SDLK_r ? kKeyTurn_rad : -kKeyTurn_rad;
  }

  const MouseSpec spec_;
  LatestValue<MouseState> states_;
  std::atomic<bool> stop_{false};
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  bool tried_ = false;
  std::string trouble_;
  std::thread thread_;
};

// For the servo thread.
class Mouse : public Steering {
 public:
  explicit Mouse(const MouseSpec& spec) : window_(spec) {}

  std::optional<Step> step(double) override {
    MouseState next;
    if (!window_.latest(next)) next = last_;
    if (!next.here) return std::nullopt;
    Step step{next.way_m - last_.way_m, next.turn_rad - last_.turn_rad, next.buttons};
    last_ = next;
    return step;
  }

 private:
  MouseWindow window_;
  MouseState last_;
};

}  // namespace

std::unique_ptr<Steering> open_mouse(const MouseSpec& spec) {
  return std::make_unique<Mouse>(spec);
}

bool desktop_is_here() {
  return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
}

}  // namespace sectio
