#include "device_bridge/drivers/gamepad.h"

#include <SDL2/SDL.h>

#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "common/core/error.h"
#include "common/core/latest_value.h"

namespace sectio {
namespace {

constexpr double kIdle = 0.12;  // share of a stick's way, which a thumb that rests may be off
constexpr std::chrono::milliseconds kPeriod{4};
constexpr int kLookAgain = 125;  // periods, for a pad that isn't there

struct PadState {
  bool here = false;
  std::array<double, SDL_CONTROLLER_AXIS_MAX> axes{};  // -1 to 1; triggers 0 to 1
  Buttons buttons;
};

double beyond_idle(double share) {
  return std::abs(share) < kIdle ? 0 : std::copysign((std::abs(share) - kIdle) / (1 - kIdle), share);
}

bool begin_sdl() {
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  return SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) == 0;
}

SDL_GameController* open_pad(const std::string& part_of_name) {
  for (int i = 0; i < SDL_NumJoysticks(); ++i) {
    const char* name = SDL_IsGameController(i) ? SDL_GameControllerNameForIndex(i) : nullptr;
    if (!name || std::string(name).find(part_of_name) == std::string::npos) continue;
    if (SDL_GameController* pad = SDL_GameControllerOpen(i)) return pad;
  }
  return nullptr;
}

class Gamepad : public Steering {
 public:
  explicit Gamepad(const GamepadSpec& spec) : spec_(spec) {
    thread_ = std::thread([this] { run(); });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return looked_; });
    if (found_) return;
    lock.unlock();
    stop_ = true;
    thread_.join();
    throw InputError("--device gamepad: no pad" + (spec.name.empty() ? "" : " with '" + spec.name + "' in its name") +
                     " is connected");
  }
  ~Gamepad() override {
    stop_ = true;
    thread_.join();
  }

  std::optional<Step> step(double dt_s) override {
    states_.load(state_);
    if (!state_.here) return std::nullopt;
    const auto axis = [&](SDL_GameControllerAxis which) { return state_.axes[which]; };
    Step step;
    const double down = axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT), up = axis(SDL_CONTROLLER_AXIS_TRIGGERLEFT);
    step.way_m =
        dt_s * spec_.speed_m_per_s * Vec3(axis(SDL_CONTROLLER_AXIS_LEFTX), -axis(SDL_CONTROLLER_AXIS_LEFTY), up - down);
    step.turn_rad =
        dt_s * spec_.turn_rad_per_s * Vec3(0, -axis(SDL_CONTROLLER_AXIS_RIGHTY), -axis(SDL_CONTROLLER_AXIS_RIGHTX));
    step.buttons = state_.buttons;
    return step;
  }

 private:
  // SDL's joysticks want one thread.
  void run() {
    const bool begun = begin_sdl();
    SDL_GameController* pad = begun ? open_pad(spec_.name) : nullptr;
    {
      const std::lock_guard lock(mutex_);
      looked_ = true;
      found_ = pad != nullptr;
    }
    changed_.notify_all();
    for (int period = 0; !stop_; ++period) {
      SDL_GameControllerUpdate();
      if (pad && !SDL_GameControllerGetAttached(pad)) {
        SDL_GameControllerClose(pad);
        pad = nullptr;
      }
      if (!pad && begun && period % kLookAgain == 0) pad = open_pad(spec_.name);
      states_.store(read(pad));
      std::this_thread::sleep_for(kPeriod);
    }
    if (pad) SDL_GameControllerClose(pad);
    if (begun) SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }

  static PadState read(SDL_GameController* pad) {
    PadState state;
    state.here = pad != nullptr;
    for (int i = 0; pad && i < SDL_CONTROLLER_AXIS_MAX; ++i)
      state.axes[static_cast<std::size_t>(i)] =
          beyond_idle(SDL_GameControllerGetAxis(pad, static_cast<SDL_GameControllerAxis>(i)) / 32767.0);
    const auto down = [&](SDL_GameControllerButton which) { return pad && SDL_GameControllerGetButton(pad, which); };
    state.buttons = {down(SDL_CONTROLLER_BUTTON_LEFTSHOULDER),
                     down(SDL_CONTROLLER_BUTTON_A) || down(SDL_CONTROLLER_BUTTON_RIGHTSHOULDER)};
    return state;
  }

  GamepadSpec spec_;
  LatestValue<PadState> states_;
  PadState state_;
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool looked_ = false, found_ = false;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Steering> open_gamepad(const GamepadSpec& spec) {
  return std::make_unique<Gamepad>(spec);
}

std::string gamepads_here() {
  if (!begin_sdl()) return "";
  std::string names;
  for (int i = 0; i < SDL_NumJoysticks(); ++i)
    if (const char* name = SDL_IsGameController(i) ? SDL_GameControllerNameForIndex(i) : nullptr)
      names += (names.empty() ? "" : ", ") + std::string(name);
  SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  return names;
}

}  // namespace sectio
