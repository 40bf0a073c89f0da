// Stands in for OpenHaptics: one stylus, whose state a test sets; the scheduler is a thread at about 1 kHz.
#include <atomic>
#include <chrono>
#include <cstring>
#include <thread>

namespace {

unsigned (*callback)(void*) = nullptr;
void* callback_data = nullptr;
std::atomic<bool> runs{false};
std::thread scheduler;

}  // namespace

extern "C" {

struct FakeError {
  unsigned code;
  int internal;
  unsigned device;
};

double fake_transform[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
double fake_force_n[3] = {0, 0, 0};
int fake_buttons = 0;
int fake_is_gone = 0;

unsigned hdInitDevice(const char* name) {
  return name && std::strcmp(name, "Left Device") != 0 ? 0xFFFFFFFFU : 1;
}
void hdDisableDevice(unsigned) {}
void hdEnable(unsigned) {}
void hdStartScheduler() {}
void hdStopScheduler() {
  runs = false;
  if (scheduler.joinable()) scheduler.join();
}
unsigned long hdScheduleAsynchronous(unsigned (*function)(void*), void* data, unsigned short) {
  callback = function;
  callback_data = data;
  runs = true;
  scheduler = std::thread([] {
    while (runs && callback(callback_data) == 1) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  return 1;
}
void hdUnschedule(unsigned long) {
  hdStopScheduler();
}
void hdBeginFrame(unsigned) {}
void hdEndFrame(unsigned) {}
void hdGetDoublev(unsigned what, double* values) {
  if (what == 0x2052) std::memcpy(values, fake_transform, sizeof fake_transform);
  if (what == 0x2603) *values = 3.3;
}
void hdGetIntegerv(unsigned, int* value) {
  *value = fake_buttons;
}
void hdSetDoublev(unsigned what, const double* values) {
  if (what == 0x2700) std::memcpy(fake_force_n, values, sizeof fake_force_n);
}
FakeError hdGetError() {
  return {fake_is_gone ? 0x0302U : 0U, 0, 1};
}
}
