// The text of --device.
#include <gtest/gtest.h>

#include "common/core/error.h"
#include "device_bridge/drivers/device_table.h"

namespace sectio {
namespace {

std::string refusal_of(const std::string& device, const std::string& trace = "") {
  try {
    prepare_device({device, trace});
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(DeviceOptions, what_can_not_be_used_is_named) {
  const std::pair<const char*, const char*> cases[] = {
      {"wand",
       "--device: expected one of scripted, virtual_hand, wish, haply, force_dimension, open_haptics, tracker, "
       "gamepad, spacemouse, mouse, got 'wand'"},
      {"haply:", "--device haply: expected KEY=VALUE, got ''"},
      {"haply:port", "--device haply: expected KEY=VALUE, got 'port'"},
      {"haply:port=1,port=2", "--device haply: port: given twice"},
      {"haply:port=0", "--device haply: port: expected 1 to 65535, got '0'"},
      {"haply:scale=", "--device haply: scale: expected 0.01 to 100, got ''"},
      {"haply:scale=nan", "--device haply: scale: expected 0.01 to 100, got 'nan'"},
      {"haply:at_m=1/2", "--device haply: at_m: expected X/Y/Z in metres, got '1/2'"},
      {"haply:at_m=1/2/x", "--device haply: at_m: expected X/Y/Z in metres, got '1/2/x'"},
      {"wish:scale=2", "--device wish: it has no option 'scale'; it has none"},
      {"gamepad:force_scale=2",
       "--device gamepad: it has no option 'force_scale'; there are at_m, turn_deg, roll_deg, "
       "scale, id, speed_m_per_s"},
      {"scripted", "--trace: needed by --device scripted"},
      {"spacemouse:socket=/none/spnav.sock", "--device spacemouse: no spacenavd answers at /none/spnav.sock"},
  };
  for (const auto& [device, said] : cases) EXPECT_EQ(refusal_of(device), said);
  EXPECT_EQ(refusal_of("wish", "hand.csv"), "--trace: --device wish plays none");
  EXPECT_EQ(refusal_of("wish"), "none");
}

TEST(DeviceOptions, the_list_has_a_line_for_each) {
  const std::vector<std::string> lines = device_list();
  EXPECT_EQ(lines.size(), 10U);
  for (const std::string& line : lines) EXPECT_EQ(line.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace sectio
