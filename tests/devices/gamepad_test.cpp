// A pad that SDL makes up: the driver finds it as it finds one of plastic.
#include <SDL2/SDL.h>
#include <gtest/gtest.h>

#include <functional>

#include "common/core/error.h"
#include "device_bridge/drivers/gamepad.h"
#include "tests/support/patience.h"

namespace sectio {
namespace {

class GamepadTest : public testing::Test {
 protected:
  GamepadTest() {
    SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
    EXPECT_EQ(SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER), 0) << SDL_GetError();
    plug_in();
  }
  ~GamepadTest() override {
    if (pad) SDL_JoystickClose(pad);
    if (index >= 0) SDL_JoystickDetachVirtual(index);
    SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }
  void plug_in() {
    index = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, SDL_CONTROLLER_AXIS_MAX,
                                      SDL_CONTROLLER_BUTTON_MAX, 0);
    ASSERT_GE(index, 0) << SDL_GetError();
    pad = SDL_JoystickOpen(index);
    SDL_JoystickSetVirtualAxis(pad, SDL_CONTROLLER_AXIS_TRIGGERLEFT, SDL_MIN_SINT16);
    SDL_JoystickSetVirtualAxis(pad, SDL_CONTROLLER_AXIS_TRIGGERRIGHT, SDL_MIN_SINT16);
  }
  void unplug() {
    SDL_JoystickClose(std::exchange(pad, nullptr));
    SDL_JoystickDetachVirtual(std::exchange(index, -1));
  }
  static bool until(Steering& steering, const std::function<bool(const std::optional<Step>&)>& holds) {
    return test::wait_until([&] { return holds(steering.step(1)); }, {}, test::kGiveUpDevice);
  }

  int index = -1;
  SDL_Joystick* pad = nullptr;
};

TEST_F(GamepadTest, sticks_and_triggers_are_speeds) {
  EXPECT_NE(gamepads_here(), "");
  const std::unique_ptr<Steering> steering = open_gamepad({.speed_m_per_s = 0.05, .turn_rad_per_s = 1});
  ASSERT_TRUE(
      until(*steering, [](const auto& step) { return step && step->way_m.isZero() && step->turn_rad.isZero(); }));
  SDL_JoystickSetVirtualAxis(pad, SDL_CONTROLLER_AXIS_LEFTX, SDL_MAX_SINT16);
  SDL_JoystickSetVirtualAxis(pad, SDL_CONTROLLER_AXIS_LEFTY, -SDL_MAX_SINT16);
  SDL_JoystickSetVirtualAxis(pad, SDL_CONTROLLER_AXIS_TRIGGERRIGHT, SDL_MAX_SINT16);
  SDL_JoystickSetVirtualAxis(pad, SDL_CONTROLLER_AXIS_RIGHTX, SDL_MAX_SINT16);
  SDL_JoystickSetVirtualButton(pad, SDL_CONTROLLER_BUTTON_A, SDL_PRESSED);
  EXPECT_TRUE(until(*steering, [](const auto& step) {
    return step && step->way_m.isApprox(Vec3(0.05, 0.05, -0.05), 1e-3) &&
           step->turn_rad.isApprox(Vec3(0, 0, -1), 1e-3) && step->buttons == Buttons{false, true};
  }));
  // A stick that rests a little beside its middle is at rest.
  SDL_JoystickSetVirtualAxis(pad, SDL_CONTROLLER_AXIS_LEFTX, 3000);
  EXPECT_TRUE(until(*steering, [](const auto& step) { return step && step->way_m.x() == 0; }));
}

TEST_F(GamepadTest, a_pad_that_is_unplugged_is_lost_until_one_is_plugged_in) {
  const std::unique_ptr<Steering> steering = open_gamepad({});
  ASSERT_TRUE(until(*steering, [](const auto& step) { return step.has_value(); }));
  unplug();
  EXPECT_TRUE(until(*steering, [](const auto& step) { return !step; }));
  plug_in();
  EXPECT_TRUE(until(*steering, [](const auto& step) { return step.has_value(); }));
}

TEST_F(GamepadTest, without_a_pad_there_is_a_line) {
  EXPECT_THROW(open_gamepad({.name = "No Such Pad"}), InputError);
  unplug();
  EXPECT_EQ(gamepads_here(), "");
  EXPECT_THROW(open_gamepad({}), InputError);
}

}  // namespace
}  // namespace sectio
