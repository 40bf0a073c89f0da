#include "device_bridge/net/bridge_net.h"

#include <semaphore.h>

#include <algorithm>

#include <atomic>
#include <ctime>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/latest_value.h"
#include "common/core/log.h"
#include "common/core/unique_id.h"
#include "common/core/wall_time.h"
#include "common/dds/endpoints.h"
#include "common/dds/keys.h"
#include "common/messages/contact.h"
#include "common/messages/link.h"
#include "common/messages/session.h"
#include "common/messages/session_servers.h"
#include "common/messages/speaker.h"
#include "common/messages/tool.h"
#include "device_bridge/net/pose_pace.h"
#include "device_bridge/net/strongest_contact.h"
#include "device_bridge/servo/ring.h"

namespace sectio {

namespace {

constexpr std::size_t kRingSamples = 64;
constexpr double kReportInterval_s = 0.5;
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
  LatestValue<ToolWish> wish;              // to the hand

  // Written by the network's thread, read by any.
  std::atomic<std::uint32_t> servers{0};
  std::atomic<std::uint64_t> packets{0};
  std::atomic<bool> met{false};
  std::atomic<bool> ended{false};
  std::atomic<bool> paused{false};
  Camera camera;  // camera of the first scene; never written again once there is one
  std::atomic<bool> has_camera{false};
  std::atomic<bool> has_tool{false};  // a scene has come that has our tool
};

// The work of the network's thread. One thread.
class Messenger {
 public:
  Messenger(const NetworkOptions& options, std::uint32_t tool_id, Handover& handover)
      : endpoints_(options, "device_bridge " + std::to_string(tool_id)), handover_(handover) {
    packet_.source = unique_id(kProgramIdBits);
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
    report();
  }

 private:
  // One packet for all new samples; older samples go with them while there is room. If there are many, some are left
  // out.
  void send_samples() {
    PoseSample sample;
    while (fresh_.size() < kRingSamples && handover_.samples.pop(sample)) {
      const bool goes_on = sample.sequence == last_popped_ + 1;
      last_popped_ = sample.sequence;
      fresh_.push_back({{packet_.tool_id, 0, sample.tool_time_s, sample.pose_world, sample.opening_rad}, goes_on});
    }
    const double now_s = steady_now_s();
    if (fresh_.empty() || (newest_pose_ && now_s - newest_pose_->sent_s < pace_.interval_s(now_s))) return;
    if (fresh_.size() > kMaxPosesPerPacket) fresh_ = evenly(fresh_, kPosesPerPacket);
    for (FreshPose& pose : fresh_) {
      pose.sample.sequence = number_ += pose.goes_on ? 1 : 2;
      packet_.samples.push_back(pose.sample);
    }
    const std::size_t keep = std::max(fresh_.size(), kPosesPerPacket);
    if (packet_.samples.size() > keep)
      packet_.samples.erase(packet_.samples.begin(), packet_.samples.end() - static_cast<std::ptrdiff_t>(keep));
    newest_pose_ = {packet_.samples.back().tool_time_s, now_s};
    pace_.sent(now_s);
    poses_ += fresh_.size();
    fresh_.clear();
    if (endpoints_.write(packet_))
      handover_.packets.fetch_add(1, std::memory_order_relaxed);
    else
      log_limited(LogLevel::warning, "write refused", "DDS refused to send a tool packet");
  }

  void take_scenes() {
    while (const auto scene = endpoints_.take<SceneInfo>()) {
      strongest_.announce(*scene);
      servers_.hear(scene->epoch, steady_now_s());
      if (!handover_.has_camera) {
        handover_.camera = scene->camera;
        handover_.has_camera = true;
      }
      if (packet_.tool_id < scene->tools.size()) {
        name_ = scene->tools[packet_.tool_id].name;
        handover_.has_tool = true;
        continue;
      }
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
      if (contact->model.tool_id == packet_.tool_id) {
        note(contact->epoch, contact->model);
        if (!strongest_.feel(steady_now_s(), *contact)) continue;
        handover_.newest.store(strongest_.model());
        if (newest_pose_) pace_.answered(steady_now_s(), age_of(contact->model));
      }
    while (const auto end = endpoints_.take<SessionEnd>()) {
      strongest_.end(steady_now_s(), end->epoch);
      servers_.end(end->epoch);
    }
    if (strongest_.all_ended(steady_now_s()) && servers_.all_ended(steady_now_s())) handover_.ended = true;
  }

  // How long ago the pose was sent that the model answers, by this program's clock alone.
  double age_of(const ContactModel& model) const {
    return steady_now_s() - newest_pose_->sent_s + (newest_pose_->tool_time_s - model.tool_time_s);
  }
  void note(std::uint64_t epoch, const ContactModel& model) {
    if (newest_pose_) ages_.add(age_of(model));
    Models& models = models_.try_emplace(epoch, Models{model.sequence, model.sequence, 0}).first->second;
    models.first = std::min(models.first, model.sequence);
    models.last = std::max(models.last, model.sequence);
    ++models.came;
  }

  void report() {
    while (const auto status = endpoints_.take<ServerStatus>()) {
      clock_.hear(steady_now_s(), packet_.source, *status);
      servers_.hear(status->epoch, steady_now_s());
      handover_.paused = status->speed == 0 || status->step == 0;
    }
    const double now_s = steady_now_s(), span_s = now_s - reported_s_;
    if (span_s < kReportInterval_s) return;
    report_.client = packet_.source;
    report_.name = name_;
    report_.kind = ProgramKind::hand;
    report_.rate_hz = static_cast<double>(poses_) / span_s;
    double came = 0, sent = 0;
    for (const auto& [epoch, models] : models_) {
      came += static_cast<double>(models.came);
      sent += static_cast<double>(models.last - models.first + 1);
    }
    report_.came_per_s = came / span_s;
    report_.lost_fraction = sent > 0 ? std::max(0.0, 1 - came / sent) : 0;
    ages_.take(report_);
    clock_.stamp(now_s, report_);
    if (!endpoints_.write(report_)) log_limited(LogLevel::warning, "report", "DDS refused to send a report");
    reported_s_ = now_s;
    poses_ = 0;
    models_.clear();
  }

  // The program that has begun is heard, of several.
  void take_wishes() {
    while (const auto wish = endpoints_.take<ToolWish>()) {
      const std::optional<std::uint32_t> of_trainee =
          endpoints_.participant().secured() ? instrument_of_trainee(endpoints_.sender<ToolWish>()) : std::nullopt;
      if (of_trainee && *of_trainee != wish->tool_id) continue;
      if (wish->tool_id != packet_.tool_id || !wisher_.hears(hash_of(endpoints_.sender<ToolWish>()), steady_now_s()) ||
          (wish->source == last_wish_.source && wish->sequence <= last_wish_.sequence))
        continue;
      last_wish_ = *wish;
      handover_.wish.store(last_wish_);
    }
  }

  Endpoints<Reads<ContactMessage, SceneInfo, SessionEnd, ToolWish, ServerStatus>, Writes<ToolPacket, LinkReport>>
      endpoints_;
  Handover& handover_;
  ToolPacket packet_;
  StrongestContact strongest_;
  SessionServers servers_;
  ToolWish last_wish_;
  Speaker wisher_;

  struct SentPose {
    double tool_time_s, sent_s;
  };
  std::optional<SentPose> newest_pose_;
  std::vector<FreshPose> fresh_;
  std::uint64_t last_popped_ = 0, number_ = 0;  // the servo loop's, and that of what was sent
  PosePace pace_;
  std::string name_ = "?";
  LinkClock clock_;
  Ages ages_;
  LinkReport report_;
  double reported_s_ = steady_now_s();
  struct Models {
    std::uint64_t first, last, came;  // first and last by their numbers
  };
  std::uint64_t poses_ = 0;                 // since the last report
  std::map<std::uint64_t, Models> models_;  // likewise, by epoch
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

  std::uint64_t samples_dropped = 0;  // used by the servo thread only
  Handover handover;
  Messenger messenger;  // used by the network's thread only
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

bool BridgeNet::session_paused() const {
  return state_->handover.paused;
}

bool BridgeNet::session_ended() const {
  return state_->handover.ended;
}

std::optional<Camera> BridgeNet::camera() const {
  if (!state_->handover.has_camera) return std::nullopt;
  return state_->handover.camera;
}

bool BridgeNet::lacks_tool() const {
  return state_->handover.has_camera && !state_->handover.has_tool;
}

std::uint64_t BridgeNet::packets_sent() const {
  return state_->handover.packets;
}

std::uint64_t BridgeNet::samples_dropped() const {
  return state_->samples_dropped;
}

}  // namespace sectio
