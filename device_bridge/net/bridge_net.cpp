#include "device_bridge/net/bridge_net.h"

#include <semaphore.h>

#include <algorithm>

#include <atomic>
#include <chrono>
#include <ctime>
#include <thread>

#include "common/core/error.h"
#include "common/core/latest_value.h"
#include "common/core/log.h"
#include "common/dds/convert.h"
#include "common/dds/endpoint.h"
#include "common/dds/renew_after_sleep.h"
#include "device_bridge/net/felt_servers.h"
#include "device_bridge/servo/ring.h"

namespace sectio {

namespace {

constexpr std::size_t kRingSamples = 64;
constexpr long kPoll_ns = 1'000'000;  // how long a contact model may lie while the servo loop is quiet

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::uint64_t source_now() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count());
}

// std::counting_semaphore of GCC 12 may sleep through a release; the POSIX one is safe to post from real time.
class Signal {
 public:
  Signal() { sem_init(&semaphore_, 0, 0); }
  ~Signal() { sem_destroy(&semaphore_); }
  Signal(const Signal&) = delete;
  Signal& operator=(const Signal&) = delete;

  void post() { sem_post(&semaphore_); }
  void wait_briefly() {
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += kPoll_ns;
    if (until.tv_nsec >= 1'000'000'000) {
      until.tv_nsec -= 1'000'000'000;
      ++until.tv_sec;
    }
    sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &until);
  }

 private:
  sem_t semaphore_;
};

}  // namespace

struct BridgeNet::State {
  // Left and taken anew by a program that slept.
  struct Seat {
    Seat(const NetworkOptions& options, std::uint32_t tool_id)
        : participant(options, "device_bridge " + std::to_string(tool_id)),
          writer(participant),
          model_reader(participant),
          end_reader(participant) {}

    Participant participant;
    Writer<wire::ToolPacket> writer;
    Reader<wire::ContactModel> model_reader;
    Reader<wire::SessionEnd> end_reader;
  };

  State(const NetworkOptions& network, std::uint32_t tool)
      : options(network), tool_id(tool), seat(std::make_unique<Seat>(options, tool_id)), ring(kRingSamples) {
    packet.source = source_now();
    packet.tool_id = tool_id;
    thread = std::thread([this] { run(); });
  }

  ~State() {
    stop = true;
    signal.post();
    thread.join();
  }

  void run() {
    while (!stop) {
      signal.wait_briefly();
      renew_after_sleep(seat, [&] { return std::make_unique<Seat>(options, tool_id); });
      servers = seat->writer.readers();
      send_samples();
      take_models();
    }
  }

  // One packet for all that is new; with it go as many older poses as there is room for.
  void send_samples() {
    PoseSample sample;
    std::size_t fresh = 0;
    while (fresh < kMaxPosesPerPacket && ring.pop(sample)) {
      packet.samples.push_back({tool_id, sample.sequence, sample.tool_time_s, sample.pose_world, sample.opening_rad});
      ++fresh;
    }
    if (fresh == 0) return;
    const std::size_t keep = std::max(fresh, kPosesPerPacket);
    if (packet.samples.size() > keep)
      packet.samples.erase(packet.samples.begin(), packet.samples.end() - static_cast<std::ptrdiff_t>(keep));
    if (seat->writer.write(to_wire(packet)))
      packets.fetch_add(1, std::memory_order_relaxed);
    else
      log_limited(LogLevel::warning, "write refused", "DDS refused to send a tool packet");
  }

  void take_models() {
    wire::ContactModel message;
    while (seat->model_reader.take(message)) {
      const std::optional<ContactMessage> contact = from_wire(message);
      if (contact && contact->model.tool_id == tool_id && felt.feel(now_s(), *contact)) newest.store(felt.model());
    }
    wire::SessionEnd end;
    while (seat->end_reader.take(end)) felt.end(end.epoch());
    if (felt.all_ended(now_s())) ended = true;
  }

  NetworkOptions options;
  std::uint32_t tool_id;
  std::unique_ptr<Seat> seat;

  // From the servo thread to ours and back.
  Ring<PoseSample> ring;
  Signal signal;
  LatestValue<ContactModel> newest;
  std::uint64_t dropped = 0;

  ToolPacket packet;
  FeltServers felt;
  std::atomic<std::uint32_t> servers{0};
  std::atomic<std::uint64_t> packets{0};
  std::atomic<bool> ended{false};
  std::atomic<bool> stop{false};
  std::thread thread;
};

BridgeNet::BridgeNet(const NetworkOptions& options, std::uint32_t tool_id) {
  if (tool_id >= kMaxTools) throw InputError("--tool-id: expected less than " + std::to_string(kMaxTools));
  state_ = std::make_unique<State>(options, tool_id);
}

BridgeNet::~BridgeNet() = default;

void BridgeNet::publish(const PoseSample& sample) {
  if (!state_->ring.push(sample)) ++state_->dropped;
  state_->signal.post();
}

bool BridgeNet::latest_model(ContactModel& model) {
  return state_->newest.load(model);
}

std::uint32_t BridgeNet::servers() const {
  return state_->servers;
}

bool BridgeNet::session_ended() const {
  return state_->ended;
}

std::uint64_t BridgeNet::packets_sent() const {
  return state_->packets;
}

std::uint64_t BridgeNet::samples_dropped() const {
  return state_->dropped;
}

}  // namespace sectio
