#include "sim_server/net/server_net.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/wall_time.h"
#include "common/messages/epoch.h"
#include "common/messages/session_fields.h"
#include "common/messages/validate.h"
#include "sim_server/net/answer_pace.h"
#include "sim_server/net/contact_sender.h"
#include "sim_server/net/handover.h"
#include "sim_server/net/input_feed.h"
#include "sim_server/net/intake.h"
#include "sim_server/net/publisher.h"

namespace sectio {

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kIdle_s = 0.005;  // how long a request may lie
constexpr double kChunkPause_s = 0.001;
constexpr double kMostLeave_s = 60;
constexpr std::size_t kInputBytes = 200'000;  // steps of the past in one message

Clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
}

// When a state is due: in its rhythm, or out of it when the simulation says so.
class StateRhythm {
 public:
  explicit StateRhythm(double interval_s) : interval_(to_duration(interval_s)) {}

  bool is_due(bool at_once) {
    const Clock::time_point now = Clock::now();
    if (!at_once && now < next_) return false;
    next_ = at_once ? now + interval_ : std::max(next_ + interval_, now - interval_ + std::chrono::microseconds(1));
    return true;
  }

 private:
  Clock::duration interval_;
  Clock::time_point next_{};
};

// A scene that a viewer would refuse is refused here, with a word.
SceneInfo checked(SceneInfo scene, std::size_t meshes) {
  if (const std::string flaw = first_flaw(scene); !flaw.empty())
    throw InputError("scene: it can't be sent to viewers: " + flaw);
  if (meshes != scene.bodies.size()) throw InputError("scene: as many meshes as bodies expected");
  return scene;
}

// The part of a server's network that its own thread runs: it publishes what the handover brings, and serves viewers.
class NetworkSide {
 public:
  NetworkSide(ServerEndpoints& endpoints, OtherServers& others, Handover& handover)
      : endpoints_(endpoints), others_(others), handover_(handover) {}
  ~NetworkSide() { pause(); }

  void begin() {
    handover_.resume();
    thread_ = std::thread([this] { run(); });
  }
  void pause() {
    handover_.stop();
    if (thread_.joinable()) thread_.join();
  }

  // These are for the simulation's thread, before begin() or after pause().
  void lead(const ServerNetOptions& options, const SceneInfo& scene, std::vector<TriangleMesh> meshes) {
    publisher_ = std::make_unique<Publisher>(endpoints_, scene, std::move(meshes), 1 / options.state_rate_hz,
                                             options.network.off_host(), options.record);
    feed_ = std::make_unique<InputFeed>(endpoints_, scene.epoch, options.inputs, kInputBytes);
    publisher_->announce();
  }
  void announce() {
    if (publisher_) publisher_->announce();
  }
  // Reports of a standby's session so far. Any thread.
  std::uint64_t hands_heard() const { return hands_heard_; }
  std::uint64_t viewers_heard() const { return viewers_heard_; }
  std::deque<StepRecord> take_last_steps() { return feed_ ? feed_->take_last_steps() : std::deque<StepRecord>(); }
  void go_on(Succession succession) {
    publisher_->repeat(succession.last_deltas, succession.last_events);
    feed_->go_on_after(succession.steps, std::move(succession.last_steps));
  }

 private:
  void run();
  void send(Outbox& batch);
  void hear_standbys();
  void hear_clients();

  ServerEndpoints& endpoints_;
  OtherServers& others_;
  Handover& handover_;
  std::unique_ptr<Publisher> publisher_;  // null: a standby
  std::unique_ptr<InputFeed> feed_;       // likewise
  double busy_s_ = 0;
  std::atomic<std::uint64_t> hands_heard_ = 0, viewers_heard_ = 0;
  std::thread thread_;
};

// A step's input before what the step has made: a standby knows no less than any viewer.
void NetworkSide::send(Outbox& batch) {
  feed_->send(batch.inputs);
  publisher_->send(batch);
  publisher_->serve_viewers();
  feed_->sent(batch.step);
  feed_->serve(handover_.shows_life());
  for (const auto& [program, epoch] : feed_->take_standbys()) others_.know_standby(program, epoch);
}

// The server may die: one of them follows it.
void NetworkSide::hear_standbys() {
  while (const auto request = endpoints_.take<StepRequest>())
    others_.know_standby(endpoints_.sender<StepRequest>(), request->epoch);
}

// A server's publisher hears them itself.
void NetworkSide::hear_clients() {
  while (const auto report = endpoints_.take<LinkReport>())
    ++(report->kind == ProgramKind::hand ? hands_heard_ : viewers_heard_);
}

void NetworkSide::run() {
  Outbox batch;
  const auto patience_s = [&] { return publisher_ && publisher_->has_more_to_send() ? kChunkPause_s : kIdle_s; };
  while (handover_.pick_up(batch, patience_s())) {
    const Clock::time_point begun = Clock::now();
    PublisherReport report = handover_.last_report();
    if (publisher_) {
      send(batch);
    } else {
      hear_standbys();
      hear_clients();
    }
    others_.listen();
    if (batch.end_reason) {
      report.end = publisher_ ? publisher_->send_end(*batch.end_reason) : SessionEnd{};
      report.copy_bytes = publisher_ ? publisher_->copy_bytes() : 0;
    }
    busy_s_ += Seconds(Clock::now() - begun).count();
    report.busy_s = busy_s_;
    if (publisher_) report.chunk_sent = publisher_->last_chunk_sent();
    report.writes_refused = publisher_ ? publisher_->writes_refused() : 0;
    handover_.report(report);
    batch.clear();
  }
}

// The contacts that hands feel: none of a frozen tool, which isn't where its hand is.
std::vector<ContactModel> felt(std::vector<ContactModel> contacts, std::uint32_t frozen_tools, AnswerPace& pace) {
  const double now_s = steady_now_s();
  std::erase_if(contacts, [&](ContactModel& contact) { return !pace.take(contact, now_s); });
  for (ContactModel& contact : contacts)
    if (is_frozen(frozen_tools, contact.tool_id))
      contact = {contact.tool_id, contact.sequence, contact.sim_time_s, contact.tool_time_s};
  return contacts;
}

}  // namespace

// The part that the simulation's thread uses.
struct ServerNet::State {
  // A standby has no epoch; a session that begins has one that is named for its program.
  State(const ServerNetOptions& o, SceneInfo scene, std::vector<TriangleMesh> meshes)
      : options(o),
        endpoints(options.network, kServerName),
        epoch(scene.epoch = o.epoch == 0 && !o.standby ? new_epoch(endpoints.id()) : o.epoch),
        others(endpoints, scene),
        follower(endpoints),
        intake(endpoints, scene.tools.size(), options.fastest_m_per_s),
        body_infos(scene.bodies),
        rhythm(1 / options.state_rate_hz) {
    handover.show_life(kHang_s);
    if (!options.standby) network.lead(options, scene, std::move(meshes));
    begin();
  }
  ~State() { pause(); }

  void begin() {
    network.begin();
    contacts.emplace([this](const ContactModel& model) {
      if (!endpoints.write(ContactMessage{epoch, model}))
        log_limited(LogLevel::warning, "write refused", "DDS refused to send a contact model");
    });
  }
  void pause() {
    contacts.reset();
    network.pause();
  }
  // The network's threads are halted meanwhile: they use the same participant.
  void renew_after_sleep() {
    if (!endpoints.overslept()) {
      endpoints.renew_after_sleep();
      return;
    }
    rejoin("was asleep");
  }
  void rejoin(const std::string& why) {
    pause();
    if (endpoints.renew(why)) network.announce();
    begin();
  }

  ServerNetOptions options;
  ServerEndpoints endpoints;
  std::uint64_t epoch;
  OtherServers others;
  Follower follower;
  Intake intake;
  std::vector<BodyInfo> body_infos;
  StateRhythm rhythm;
  Handover handover;
  std::optional<ContactSender> contacts;  // to hands, on a thread of its own
  AnswerPace answers;
  NetworkSide network{endpoints, others, handover};
};

ServerNet::ServerNet(const ServerNetOptions& options, SceneInfo scene, std::vector<TriangleMesh> meshes) {
  if (scene.world_bodies.empty())
    for (const BodyInfo& body : scene.bodies) scene.world_bodies.push_back(body.name);
  const std::size_t count = meshes.size();
  state_ = std::make_unique<State>(options, checked(std::move(scene), count), std::move(meshes));
}

ServerNet::~ServerNet() = default;

void ServerNet::show_life(double for_s) {
  state_->handover.show_life(for_s);
}

void ServerNet::take_samples(std::vector<ToolSample>& samples) {
  show_life();
  state_->renew_after_sleep();
  state_->intake.take_samples(samples);
}

std::vector<std::uint32_t> ServerNet::take_silent_tools() {
  return state_->intake.take_silent_tools();
}

void ServerNet::expect(std::uint32_t tool_id) {
  state_->intake.expect(tool_id);
}

std::vector<SessionOrder> ServerNet::take_orders() {
  return state_->intake.take_orders();
}

std::uint64_t ServerNet::orders_refused() const {
  return state_->intake.orders_refused();
}

void ServerNet::set_frozen(std::uint32_t tool_id, bool frozen) {
  state_->intake.set_frozen(tool_id, frozen);
  state_->handover.put([&](Outbox& outbox) { outbox.frozen_tools = frozen_tools(); });
}

std::uint32_t ServerNet::frozen_tools() const {
  return state_->intake.frozen_tools();
}

void ServerNet::set_pace(const Pace& pace) {
  state_->handover.put([&](Outbox& outbox) {
    outbox.speed = pace.now();
    outbox.speed_set = pace.speed();
  });
}

void ServerNet::set_end(double ends_s) {
  state_->handover.put([&](Outbox& outbox) { outbox.ends_s = ends_s; });
}

void ServerNet::rejoin(const std::string& why) {
  state_->rejoin(why);
}

std::uint64_t ServerNet::hands_heard() const {
  return state_->network.hands_heard();
}

std::uint64_t ServerNet::viewers_heard() const {
  return state_->network.viewers_heard();
}

std::size_t ServerNet::servers_known() const {
  const std::vector<Peer> peers = state_->endpoints.participant().peers();
  return static_cast<std::size_t>(std::ranges::count_if(peers, [&](const Peer& peer) {
    return peer.name == kServerName && peer.announcement->session == state_->options.network.session;
  }));
}

Follower& ServerNet::follower() {
  return state_->follower;
}

void ServerNet::take_over(Succession succession) {
  State& s = *state_;
  s.pause();
  s.epoch = succession.scene.epoch = succession.epoch;
  s.others.become(succession.epoch);
  if (succession.scene.world_bodies.empty())
    for (const BodyInfo& body : s.body_infos) succession.scene.world_bodies.push_back(body.name);
  s.body_infos = succession.scene.bodies;
  s.options.inputs = succession.inputs;
  s.options.record = succession.record;
  if (succession.last_steps.empty()) succession.last_steps = s.network.take_last_steps();
  s.network.lead(s.options, succession.scene, std::move(succession.meshes));
  s.handover.put([&](Outbox& outbox) { outbox.begin_term_after(succession.steps); });
  s.network.go_on(std::move(succession));
  s.begin();
}

void ServerNet::publish(const StepOutput& output, const WorldView& world, double step_wall_time_s,
                        std::optional<StepRecord> input) {
  show_life();
  State& s = *state_;
  const bool due = s.rhythm.is_due(output.publish_now);
  s.others.advance(output.sim_time_s);
  for (const NewBody& body : output.new_bodies) {
    if (body.body_id < s.body_infos.size()) continue;
    s.body_infos.push_back(s.body_infos.at(body.parent_id));
    s.body_infos.back().name = body.name;
  }
  s.contacts->put(felt(output.contacts, frozen_tools(), s.answers));
  s.handover.put([&](Outbox& outbox) {
    if (input) outbox.inputs.push_back(std::move(*input));
    outbox.put(output, world, s.body_infos, step_wall_time_s, due);
    outbox.samples_refused = s.intake.samples_refused() + s.endpoints.damaged<ToolPacket>();
  });
}

void ServerNet::name_bodies(std::vector<BodyInfo> bodies) {
  state_->body_infos = std::move(bodies);
}

void ServerNet::tell(const Event& event) {
  state_->handover.put([&](Outbox& outbox) { outbox.events.push_back(event); });
}

SessionEnd ServerNet::end_session(const std::string& reason) {
  state_->handover.put([&](Outbox& outbox) { outbox.end_reason = reason; });
  return state_->handover.wait_for_end();
}

const OtherServers& ServerNet::others() const {
  return state_->others;
}

std::size_t ServerNet::copy_bytes() const {
  return state_->handover.last_report().copy_bytes;
}

double ServerNet::busy_s() const {
  return state_->handover.last_report().busy_s;
}

std::uint32_t ServerNet::viewers() const {
  return writer_to_viewers(state_->endpoints).readers();
}

std::uint32_t ServerNet::lost_viewers() const {
  return writer_to_viewers(state_->endpoints).lost_readers();
}

bool ServerNet::wait_for_viewers_to_leave(double timeout_s) {
  const Clock::time_point begun = Clock::now();
  while (viewers() > 0 || lost_viewers() > 0) {
    const Clock::time_point served = std::max(begun, state_->handover.last_report().chunk_sent);
    if (Clock::now() >= std::min(served + to_duration(timeout_s), begun + to_duration(kMostLeave_s))) return false;
    std::this_thread::sleep_for(Seconds(kIdle_s));
  }
  return true;
}

std::uint64_t ServerNet::epoch() const {
  return state_->epoch;
}

std::uint64_t ServerNet::writes_refused() const {
  return state_->handover.last_report().writes_refused;
}

}  // namespace sectio
