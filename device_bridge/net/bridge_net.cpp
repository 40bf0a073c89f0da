#include "device_bridge/net/bridge_net.h"

#include <semaphore.h>

#include <algorithm>

#include <atomic>
#include <ctime>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/latest_value.h"
#include "common/core/log.h"
#include "common/core/wall_time.h"
#include "common/dds/endpoints.h"
#include "common/dds/keys.h"
#include "common/messages/contact.h"
#include "common/messages/session.h"
#include "common/messages/speaker.h"
#include "common/messages/tool.h"
#include "device_bridge/net/strongest_contact.h"
#include "device_bridge/servo/ring.h"

namespace sectio {

namespace {

constexpr std::size_t kRingSamples = 64;
constexpr long kPoll_ns = 1'000'000;  // how long a contact model may lie while the servo loop is quiet

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

// Between the servo thread and the network's thread; without a lock.
struct Handover {
  Ring<PoseSample> samples{kRingSamples};  // to the network
  Signal signal;                           // there is a sample
  LatestValue<ContactModel> newest;        // to the hand
  LatestValue<ToolWish> wish;              // likewise

  // Written by the network's thread, read by any.
  std::atomic<std::uint32_t> servers{0};
  std::atomic<std::uint64_t> packets{0};
  std::atomic<bool> met{false};
  std::atomic<bool> ended{false};
  Camera camera;  // the first scene's; never written again once there is one
  std::atomic<bool> has_camera{false};
};

// The work of the network's thread. One thread.
class Messenger {
 public:
  Messenger(const NetworkOptions& options, std::uint32_t tool_id, Handover& handover)
      : endpoints_(options, "device_bridge " + std::to_string(tool_id)), handover_(handover) {
    packet_.source = microseconds_since_1970();
    packet_.tool_id = tool_id;
  }

  void run_once() {
    endpoints_.renew_after_sleep();
    handover_.servers = endpoints_.writer<ToolPacket>().readers();
    if (handover_.servers > 0) handover_.met = true;
    send_samples();
    take_scenes();
    take_models();
    take_wishes();
  }

 private:
  // One packet for all new samples; older samples go with them while there is room.
  void send_samples() {
    PoseSample sample;
    std::size_t fresh = 0;
    while (fresh < kMaxPosesPerPacket && handover_.samples.pop(sample)) {
      packet_.samples.push_back(
          {packet_.tool_id, sample.sequence, sample.tool_time_s, sample.pose_world, sample.opening_rad});
      ++fresh;
    }
    if (fresh == 0) return;
    const std::size_t keep = std::max(fresh, kPosesPerPacket);
    if (packet_.samples.size() > keep)
      packet_.samples.erase(packet_.samples.begin(), packet_.samples.end() - static_cast<std::ptrdiff_t>(keep));
    if (endpoints_.write(packet_))
      handover_.packets.fetch_add(1, std::memory_order_relaxed);
    else
      log_limited(LogLevel::warning, "write refused", "DDS refused to send a tool packet");
  }

  void take_scenes() {
    while (const auto scene = endpoints_.take<SceneInfo>()) {
      strongest_.announce(*scene);
      if (!handover_.has_camera) {
        handover_.camera = scene->camera;
        handover_.has_camera = true;
      }
      if (packet_.tool_id < scene->tools.size()) continue;
      std::string tools;
      for (std::size_t i = 0; i < scene->tools.size(); ++i)
        tools += (i > 0 ? ", " : "") + std::to_string(i) + " " + scene->tools[i].name;
      log_limited(LogLevel::warning, "unknown tool",
                  "the scene has no tool " + std::to_string(packet_.tool_id) +
                      (tools.empty() ? ", and no other" : "; it has " + tools));
    }
  }

  void take_models() {
    while (const auto contact = endpoints_.take<ContactMessage>())
      if (contact->model.tool_id == packet_.tool_id && strongest_.feel(steady_now_s(), *contact))
        handover_.newest.store(strongest_.model());
    while (const auto end = endpoints_.take<SessionEnd>()) strongest_.end(steady_now_s(), end->epoch);
    if (strongest_.all_ended(steady_now_s())) handover_.ended = true;
  }

  // The source of wishes that has begun, of several.
  void take_wishes() {
    while (const auto wish = endpoints_.take<ToolWish>()) {
      const std::optional<std::uint32_t> of_trainee =
          endpoints_.participant().secured() ? instrument_of_trainee(endpoints_.sender<ToolWish>()) : std::nullopt;
      if (of_trainee && *of_trainee != wish->tool_id) continue;
      if (wish->tool_id != packet_.tool_id || !wisher_.hears(wish->source, steady_now_s()) ||
          (wish->source == last_wish_.source && wish->sequence <= last_wish_.sequence))
        continue;
      last_wish_ = *wish;
      handover_.wish.store(last_wish_);
    }
  }

  Endpoints<Reads<ContactMessage, SceneInfo, SessionEnd, ToolWish>, Writes<ToolPacket>> endpoints_;
  Handover& handover_;
  ToolPacket packet_;
  StrongestContact strongest_;
  ToolWish last_wish_;
  Speaker wisher_;
};

}  // namespace

struct BridgeNet::State {
  State(const NetworkOptions& options, std::uint32_t tool_id) : messenger(options, tool_id, handover) {
    thread = std::thread([this] {
      while (!stop) {
        handover.signal.wait_briefly();
        messenger.run_once();
      }
    });
  }
  ~State() {
    stop = true;
    handover.signal.post();
    thread.join();
  }

  std::uint64_t samples_dropped = 0;  // servo thread's
  Handover handover;
  Messenger messenger;  // network's thread's
  std::atomic<bool> stop{false};
  std::thread thread;
};

BridgeNet::BridgeNet(const NetworkOptions& options, std::uint32_t tool_id) {
  if (tool_id >= kMaxTools) throw InputError("--tool-id: expected less than " + std::to_string(kMaxTools));
  state_ = std::make_unique<State>(options, tool_id);
}

BridgeNet::~BridgeNet() = default;

void BridgeNet::publish(const PoseSample& sample) {
  if (!state_->handover.samples.push(sample)) ++state_->samples_dropped;
  state_->handover.signal.post();
}

bool BridgeNet::latest_model(ContactModel& model) {
  return state_->handover.newest.load(model);
}

bool BridgeNet::latest_wish(ToolWish& wish) {
  return state_->handover.wish.load(wish);
}

std::uint32_t BridgeNet::servers() const {
  return state_->handover.servers;
}

bool BridgeNet::met_a_server() const {
  return state_->handover.met;
}

bool BridgeNet::session_ended() const {
  return state_->handover.ended;
}

std::optional<Camera> BridgeNet::camera() const {
  if (!state_->handover.has_camera) return std::nullopt;
  return state_->handover.camera;
}

std::uint64_t BridgeNet::packets_sent() const {
  return state_->handover.packets;
}

std::uint64_t BridgeNet::samples_dropped() const {
  return state_->samples_dropped;
}

}  // namespace sectio
