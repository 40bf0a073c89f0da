// Devices by their makers' libraries, with libraries that stand in for them.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <functional>

#include "common/core/error.h"
#include "device_bridge/device/held_device.h"
#include "device_bridge/drivers/force_dimension.h"
#include "device_bridge/drivers/open_haptics.h"
#include "tests/support/patience.h"

namespace sectio {
namespace {

// The variables of a library that stands in; the driver has loaded the same one.
class Fake {
 public:
  explicit Fake(const char* file) : library_(dlopen(file, RTLD_NOW | RTLD_LOCAL)) { EXPECT_NE(library_, nullptr); }
  ~Fake() { dlclose(library_); }
  template <class T>
  T* find(const char* name) const {
    return static_cast<T*>(dlsym(library_, name));
  }

 private:
  void* library_;
};

// Drives a handle as a servo does until a condition holds.
bool until(Handle& handle, const Vec3& force_n, const Vec3& moment_n_m,
           const std::function<bool(HandleState&)>& holds) {
  HandleState state;
  const auto is_so = [&] {
    handle.apply(force_n, moment_n_m);
    handle.latest(state);
    return holds(state);
  };
  return test::wait_until(is_so, {}, test::kGiveUpDevice);
}

std::string refusal_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(ForceDimension, measures_in_the_axes_of_a_person_and_pushes_back) {
  const Fake fake(SECTIO_FAKE_DHD);
  auto* place_m = fake.find<double>("fake_place_m");
  auto* load = fake.find<double>("fake_load");
  const std::unique_ptr<Handle> handle = open_force_dimension(SECTIO_FAKE_DHD);
  EXPECT_FALSE(handle->lost());
  EXPECT_EQ(handle->limits().largest_moment_n_m, 0.1);
  place_m[0] = -0.03;  // away from the person
  place_m[1] = 0.01;   // to the right
  place_m[2] = 0.02;
  *fake.find<int>("fake_buttons") = 2;
  ASSERT_TRUE(until(*handle, {1, 2, 3}, {0.1, 0.2, 0.3}, [&](const HandleState& s) {
    return s.buttons.clutch && load[0] == -2 && s.pose.position_m.isApprox(Vec3(0.01, 0.03, 0.02), 1e-12);
  }));
  EXPECT_EQ(load[1], 1);
  EXPECT_EQ(load[2], 3);
  EXPECT_EQ(load[3], -0.2);
  HandleState state;
  ASSERT_TRUE(until(*handle, Vec3::Zero(), Vec3::Zero(), [&](HandleState& s) {
    state = s;
    return s.has_opening && s.pose.position_m.z() > 0;
  }));
  EXPECT_NEAR(state.opening_share, 0.5, 1e-9);
  // A pen that points away from the person: its shaft comes back, the sharp edge is below.
  EXPECT_TRUE((state.pose.orientation * Vec3::UnitZ()).isApprox(-Vec3::UnitY(), 1e-9));
  EXPECT_TRUE((state.pose.orientation * Vec3::UnitX()).isApprox(-Vec3::UnitZ(), 1e-9));

  *fake.find<int>("fake_is_gone") = 1;
  EXPECT_TRUE(until(*handle, Vec3::Zero(), Vec3::Zero(), [&](HandleState&) { return handle->lost(); }));
  *fake.find<int>("fake_is_gone") = 0;
  EXPECT_TRUE(until(*handle, Vec3::Zero(), Vec3::Zero(), [&](HandleState&) { return !handle->lost(); }));
}

TEST(ForceDimension, gives_no_force_that_the_servo_has_not_asked_for_lately) {
  const Fake fake(SECTIO_FAKE_DHD);
  auto* load = fake.find<double>("fake_load");
  const std::unique_ptr<Handle> handle = open_force_dimension(SECTIO_FAKE_DHD);
  ASSERT_TRUE(until(*handle, {0, 0, 2}, Vec3::Zero(), [&](HandleState&) { return load[2] == 2; }));
  test::wait_until([&] { return load[2] == 0; }, {}, test::kGiveUpDevice);
  EXPECT_EQ(load[2], 0);
}

TEST(ForceDimension, says_that_there_is_no_library_or_no_device) {
  EXPECT_EQ(refusal_of([] { open_force_dimension("libnone.so.3"); }).find("--device force_dimension: its maker's"), 0U);
  const Fake fake(SECTIO_FAKE_DHD);
  *fake.find<int>("fake_is_gone") = 1;
  EXPECT_EQ(refusal_of([] { open_force_dimension(SECTIO_FAKE_DHD); }),
            "--device force_dimension: no device answers: no device found");
  *fake.find<int>("fake_is_gone") = 0;
  EXPECT_NE(refusal_of([] { open_force_dimension(SECTIO_FAKE_HD); }).find("has no function dhdOpen"),
            std::string::npos);
}

TEST(OpenHaptics, measures_millimetres_and_pushes_back) {
  const Fake fake(SECTIO_FAKE_HD);
  auto* transform = fake.find<double>("fake_transform");
  auto* force_n = fake.find<double>("fake_force_n");
  const std::unique_ptr<Handle> handle = open_open_haptics(SECTIO_FAKE_HD, "Left Device");
  EXPECT_EQ(handle->limits().largest_force_n, 3.3);
  transform[12] = 10;   // to the right
  transform[13] = 20;   // up
  transform[14] = -30;  // away from the person
  *fake.find<int>("fake_buttons") = 1;
  ASSERT_TRUE(until(*handle, {1, 2, 3}, Vec3::Zero(), [&](const HandleState& s) {
    return s.buttons.grip && force_n[1] == 3 && s.pose.position_m.isApprox(Vec3(0.01, 0.03, 0.02), 1e-12);
  }));
  EXPECT_EQ(force_n[0], 1);
  EXPECT_EQ(force_n[2], -2);
  *fake.find<int>("fake_is_gone") = 1;
  EXPECT_TRUE(until(*handle, Vec3::Zero(), Vec3::Zero(), [&](HandleState&) { return handle->lost(); }));
  *fake.find<int>("fake_is_gone") = 0;
}

TEST(OpenHaptics, says_that_there_is_no_library_or_no_device) {
  EXPECT_EQ(refusal_of([] { open_open_haptics("libnone.so", ""); }).find("--device open_haptics: its maker's"), 0U);
  EXPECT_EQ(refusal_of([] { open_open_haptics(SECTIO_FAKE_HD, "Right Device"); }),
            "--device open_haptics: no device 'Right Device' answers");
}

}  // namespace
}  // namespace sectio
