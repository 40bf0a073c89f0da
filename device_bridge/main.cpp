#include <signal.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>
#include <utility>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/core/stop_signal.h"
#include "common/core/wall_time.h"
#include "common/dds/find_session.h"
#include "common/dds/keys.h"
#include "common/dds/network_arguments.h"
#include "common/messages/session.h"
#include "device_bridge/drivers/device_table.h"
#include "device_bridge/net/bridge_net.h"
#include "device_bridge/servo/record_writer.h"
#include "device_bridge/servo/servo_loop.h"

namespace sectio {
namespace {

struct Options {
  DeviceRequest request;
  std::uint32_t tool_id = 0;
  NetworkOptions network;
  std::string log_file, record_file;
  double duration_s = 0;
  bool wait_for_server = false;
};

// Returns false when it has printed the list that was asked for.
bool list_devices() {
  for (const std::string& line : device_list()) std::printf("%s\n", line.c_str());
  return false;
}

// Two files of one program must not be the same one; the disk says whether they are.
void check_files(const Options& o) {
  const std::array files{std::pair("--trace", o.request.trace_file), std::pair("--log", o.log_file),
                         std::pair("--record", o.record_file)};
  for (std::size_t i = 0; i < files.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      std::error_code not_there;
      if (files[i].second.empty() || files[k].second.empty()) continue;
      if (files[i].second == files[k].second ||
          std::filesystem::equivalent(files[i].second, files[k].second, not_there))
        throw InputError(std::string(files[i].first) + ": " + files[i].second + " is the file of " + files[k].first);
    }
}

bool parse(int argc, char** argv, Options& o) {
  Arguments arguments("device_bridge",
                      "Turns a hand-held instrument into tool poses and gives the hand its force, at 1 kHz.");
  arguments.option("--trace", o.request.trace_file,
                   "motion to play: CSV with time_s,x_world_m,y_world_m,z_world_m,qw,qx,qy,qz");
  bool list = false;
  arguments.option("--device", o.request.device, "NAME or NAME:KEY=VALUE,...: see --list-devices");
  arguments.toggle("--list-devices", list, "prints the devices, their options, and which are here, a line each");
  arguments.option("--max-speed-m-per-s", o.request.fastest_m_per_s,
                   "the largest speed of devices wish, gamepad and mouse; faster motion is followed at this speed");
  arguments.option("--tool-id", o.tool_id, "index of the tool in the server's scene");
  add_network_arguments(arguments, o.network, "session to join; empty: the only one of the domain");
  arguments.option("--log", o.log_file,
                   "CSV file for pose, force, age of the model, overruns and time of waking of every tick; it can be "
                   "played as a trace");
  arguments.option("--record", o.record_file,
                   "CSV file for the poses of every tick, whatever device it is: a trace, which a scene can play");
  arguments.option("--duration-s", o.duration_s, "time to run in seconds; 0: as long as the trace");
  arguments.toggle("--wait-for-server", o.wait_for_server, "begin the motion when a server listens");
  if (!arguments.parse(argc, argv)) return false;
  if (list) return list_devices();
  if (o.duration_s < 0) throw InputError("--duration-s: expected >= 0, got " + std::to_string(o.duration_s));
  if (!(o.request.fastest_m_per_s > 0 && o.request.fastest_m_per_s <= 100))
    throw InputError("--max-speed-m-per-s: expected more than 0, at most 100, got " +
                     std::to_string(o.request.fastest_m_per_s));
  if (o.tool_id >= kMaxTools)
    throw InputError("--tool-id: expected 0 to " + std::to_string(kMaxTools - 1) + ", got " +
                     std::to_string(o.tool_id));
  check_files(o);
  check_network_options(o.network);
  return true;
}

// Signals to stop are taken here and nowhere else: blocked before any thread is made, waited for by main.
class Signals {
 public:
  Signals() {
    sigemptyset(&set_);
    for (const int number : stop_signals()) sigaddset(&set_, number);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  }
  // True when one came; false after the time.
  bool wait(std::chrono::milliseconds time) const {
    const timespec limit{time.count() / 1000, time.count() % 1000 * 1'000'000};
    return sigtimedwait(&set_, nullptr, &limit) > 0;
  }

 private:
  sigset_t set_;
};

class NetLink : public ServoLink, public WishSource {
 public:
  explicit NetLink(BridgeNet& net) : net_(net) {}
  void publish(const PoseSample& sample) override { net_.publish(sample); }
  bool latest_model(ContactModel& model) override { return net_.latest_model(model); }
  bool latest_wish(HandWish& wish) override {
    if (!net_.latest_wish(wish_)) return false;
    wish = {wish_.pose_world, wish_.held};
    return true;
  }

 private:
  BridgeNet& net_;
  ToolWish wish_;
};

// True when a model has come.
bool log_progress(ServoLog& log, const BridgeNet& net) {
  ServoRecord r;
  if (!log.newest.load(r)) return true;
  const std::string age = r.too_old_s > 0     ? formatted("%.0f ms, too old to be felt", 1000 * r.too_old_s)
                          : r.model_age_s < 0 ? "no model yet"
                                              : std::to_string(std::lround(1000 * r.model_age_s)) + " ms";
  log_info(formatted("%.1f s, force %.2f N, age of model: %s, overruns: %llu, servers: %u", r.sample.tool_time_s,
                     r.force_world_n.norm(), age.c_str(), static_cast<unsigned long long>(r.overruns), net.servers()));
  return r.model_age_s >= 0;
}

constexpr double kSessionPatience_s = 60;
constexpr double kToBeAnswered_s = 3;
constexpr const char* kUnheard =
    "no pose was answered: another bridge moves this instrument, the session plays its own traces, or the link is too "
    "slow (docs/links.md)";
constexpr std::chrono::milliseconds kPoll{50};
constexpr std::chrono::milliseconds kProgress{1000};

// False when a signal came first, or none has come in the time that was given.
bool wait_for_server(const BridgeNet& net, const Signals& signals, double duration_s) {
  if (net.servers() == 0) log_info("waiting for a server");
  const double begun_s = steady_now_s();
  while (net.servers() == 0) {
    if (signals.wait(kPoll) || (duration_s > 0 && steady_now_s() - begun_s > duration_s)) return false;
  }
  return true;
}

// A device without a place of its own appears where the scene's camera looks. Returns nothing when a signal came first.
std::unique_ptr<Device> finish_device(PreparedDevice& prepared, WishSource& wishes, const BridgeNet& net,
                                      const Signals& signals) {
  while (prepared.wants_scene() && !net.camera())
    if (signals.wait(kPoll)) return nullptr;
  return prepared.finish(wishes, net.camera());
}

// A line whenever the device is lost or is back; returns what it is now.
DeviceStatus tell_status(const ServoLog& log, DeviceStatus told) {
  const DeviceStatus now = log.device_status;
  if (now != told && now == DeviceStatus::lost) log_warning("the device is lost: its instrument is let go");
  if (now != told && now == DeviceStatus::ready) log_info("the device is back");
  return now;
}

int no_server(const NetworkOptions& network) {
  log_error("no server of session '" + network.session + "' on domain " + std::to_string(network.domain) + " was met");
  return 1;
}

// A server hears a trainee for the own instrument alone.
void tell_if_keys_are_for_another_tool(const Options& o) {
  const std::optional<Keys> keys = Keys::of(o.network);
  if (keys && keys->identity().starts_with(kTrainee) && keys->identity() != trainee_of(o.tool_id))
    log_warning("--tool-id " + std::to_string(o.tool_id) + ": the keys are those of " + keys->identity() +
                ": no server will hear it");
}

int run(Options& o) {
  const Signals signals;
  tell_if_keys_are_for_another_tool(o);
  PreparedDevice prepared = prepare_device(o.request);
  RecordWriter writer(o.log_file, o.record_file);
  if (!find_session(o.network, o.duration_s > 0 ? std::min(kSessionPatience_s, o.duration_s) : kSessionPatience_s,
                    [&] { return signals.wait(std::chrono::milliseconds(0)); }))
    return 1;
  BridgeNet net(o.network, o.tool_id);
  if (o.wait_for_server && !wait_for_server(net, signals, o.duration_s)) return no_server(o.network);

  NetLink link(net);
  const std::unique_ptr<Device> device = finish_device(prepared, link, net, signals);
  if (!device) return no_server(o.network);
  ServoLog log;
  ServoState state(device->limits());
  std::atomic<bool> stop = false;
  std::atomic<bool> servo_done = false;
  ServoTiming timing;
  timing.period_ns = std::llround(1e9 / device->limits().rate_hz);
  if (o.duration_s > 0) timing.duration_s = o.duration_s;

  std::thread servo([&] {
    if (!request_real_time()) {
      log_warning("no permission for real-time priority (SCHED_FIFO): expect overruns on a busy machine");
    }
    run_servo(*device, link, state, log, timing, stop);
    servo_done = true;
  });
  std::thread scribe([&] {
    while (!servo_done) {
      writer.drain(log.records);
      std::this_thread::sleep_for(kPoll);
    }
    writer.drain(log.records);
  });

  bool told_unheard = false;
  double speaks_since_s = steady_now_s();  // to a server that goes on
  std::uint64_t said = 0;                  // packets
  DeviceStatus status = DeviceStatus::ready;
  auto next_line = std::chrono::steady_clock::now() + kProgress;
  while (!servo_done) {
    if (signals.wait(kPoll)) {
      log_info("stopping");
      stop = true;
      break;
    }
    if (net.session_ended()) {
      log_info("the session has ended");
      stop = true;
      break;
    }
    status = tell_status(log, status);
    if (std::chrono::steady_clock::now() >= next_line) {
      const bool is_answered = log_progress(log, net);
      const bool speaks = net.packets_sent() > std::exchange(said, net.packets_sent());
      if (!(speaks && net.met_a_server() && !net.session_paused())) speaks_since_s = steady_now_s();
      if (!told_unheard && steady_now_s() - speaks_since_s > kToBeAnswered_s && !is_answered) {
        log_warning(kUnheard);
        told_unheard = true;
      }
      next_line += kProgress;
    }
  }
  servo.join();
  scribe.join();
  writer.finish();
  log_info(std::to_string(writer.written()) + " ticks, " + std::to_string(net.packets_sent()) + " packets sent, " +
           std::to_string(log.dropped_records) + " records and " + std::to_string(net.samples_dropped()) +
           " samples dropped");
  if (status == DeviceStatus::lost) {
    log_error("--device " + o.request.device + ": the device was lost, and did not come back");
    return 1;
  }
  if (net.lacks_tool()) {
    log_error("--tool-id " + std::to_string(o.tool_id) + ": the scene has no such tool: nothing was moved");
    return 1;
  }
  const bool was_unheard = told_unheard || steady_now_s() - speaks_since_s > kToBeAnswered_s;
  if (net.met_a_server() && !net.session_paused() && !writer.was_answered() && was_unheard) {
    log_error(kUnheard);
    return 1;
  }
  return net.met_a_server() ? 0 : no_server(o.network);
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("device_bridge", [&] {
    sectio::Options options;
    return sectio::parse(argc, argv, options) ? sectio::run(options) : 0;
  });
}
