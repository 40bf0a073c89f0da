#include "sim_server/net/server_net.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/dds/convert.h"
#include "common/dds/endpoint.h"
#include "common/delta/keyframe.h"
#include "common/messages/chunks.h"
#include "sim_server/net/sample_deduplicator.h"

namespace sectio {

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kStatusInterval_s = 0.5;
constexpr double kKeyframeInterval_s = 0.1;  // at most one a body; requests in between are served together
constexpr double kIdle_s = 0.005;            // how long a request may lie
constexpr double kChunkPause_s = 0.001;
constexpr std::size_t kChunksPerRound = 16;  // between two looks into the outbox: 0.5 MB; off host 19 kB

std::uint64_t epoch_now() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count());
}

}  // namespace

struct ServerNet::State {
  State(const ServerNetOptions& options, SceneInfo scene_info, std::vector<TriangleMesh> meshes);
  ~State();

  void run();
  void send(Outbox& batch);
  void add_body(BodyInfo info, TriangleMesh mesh);
  void send_delta(const BodyDelta& delta);
  void send_state();
  void send_status(const Outbox& batch);
  void send_end(const std::string& reason);
  void take_requests();
  void queue_keyframes(Clock::time_point now);
  void send_chunks();
  std::vector<BodyVersion> versions() const;

  template <class T>
  void write(Writer<T>& writer, const T& message);

  SceneInfo scene;                   // the publishing thread's: grows with the bodies
  std::vector<BodyInfo> body_infos;  // the simulation's thread's

  // Constant once the thread runs.
  double state_interval_s;
  std::uint32_t chunk_bytes;

  Participant participant;
  Reader<wire::ToolPacket> tool_reader;
  Reader<wire::GravityRequest> gravity_reader;
  Reader<wire::KeyframeRequest> request_reader;
  Writer<wire::SceneInfo> scene_writer;
  Writer<wire::TopologyDelta> delta_writer;
  Writer<wire::KeyframeChunk> chunk_writer;
  Writer<wire::StateHeader> header_writer;
  Writer<wire::StatePiece> piece_writer;
  Writer<wire::ContactModel> contact_writer;
  Writer<wire::Event> event_writer;
  Writer<wire::ServerStatus> status_writer;
  Writer<wire::SessionEnd> end_writer;
  OtherServers others;

  // Simulation's thread.
  SampleDeduplicator deduplicator;
  std::uint64_t damaged_samples = 0;
  std::uint64_t last_gravity_source = 0;
  Clock::time_point next_state{};

  // Both, under the lock.
  std::mutex mutex;
  std::condition_variable wake;
  std::condition_variable ended;
  Outbox outbox;
  bool stop = false;
  std::optional<SessionEnd> session_end;
  std::uint64_t refused = 0;
  std::size_t copy_bytes = 0;
  double busy_s = 0;

  // Publishing thread.
  struct Shadow {
    TriangleMesh mesh;
    bool keyframe_wanted = false;
    Clock::time_point keyframe_sent{};
  };
  std::vector<Shadow> shadows;
  StateEncoder encoder;
  StateSnapshot last_snapshot;
  bool any_snapshot = false;
  bool unsent_snapshot = false;
  Clock::time_point state_sent{};
  std::deque<KeyframeChunk> chunks;
  Clock::time_point next_status{};
  std::uint64_t refused_here = 0;
  double busy_here_s = 0;
  std::thread thread;
};

ServerNet::State::State(const ServerNetOptions& options, SceneInfo scene_info, std::vector<TriangleMesh> meshes)
    : scene(std::move(scene_info)),
      state_interval_s(1 / options.state_rate_hz),
      chunk_bytes(options.network.off_host() ? kChunkBytesOffHost : kChunkBytes),
      participant(options.network, "sim_server"),
      tool_reader(participant),
      gravity_reader(participant),
      request_reader(participant),
      scene_writer(participant),
      delta_writer(participant),
      chunk_writer(participant),
      header_writer(participant),
      piece_writer(participant),
      contact_writer(participant),
      event_writer(participant),
      status_writer(participant),
      end_writer(participant),
      others(participant, scene),
      deduplicator(scene.tools.size()),
      encoder(scene.epoch, scene.step_s, scene.bodies.size()) {
  body_infos = scene.bodies;
  for (TriangleMesh& mesh : meshes) shadows.push_back({std::move(mesh), false, {}});
  // What a viewer would refuse is refused here, with a word.
  if (!from_wire(to_wire(scene))) throw InputError("scene: names, colours or camera that can't be sent to viewers");
  if (shadows.size() != scene.bodies.size()) throw InputError("scene: as many meshes as bodies expected");
  write(scene_writer, to_wire(scene));
  thread = std::thread([this] { run(); });
}

ServerNet::State::~State() {
  {
    const std::lock_guard lock(mutex);
    stop = true;
  }
  wake.notify_one();
  thread.join();
}

template <class T>
void ServerNet::State::write(Writer<T>& writer, const T& message) {
  if (writer.write(message)) return;
  ++refused_here;
  log_limited(LogLevel::warning, "write refused", "DDS refused to send a message");
}

void ServerNet::State::run() {
  Outbox batch;
  while (true) {
    {
      std::unique_lock lock(mutex);
      refused = refused_here;
      if (!outbox.urgent() && !stop) wake.wait_for(lock, Seconds(chunks.empty() ? kIdle_s : kChunkPause_s));
      if (stop && !outbox.urgent()) return;
      busy_s = busy_here_s;
      std::swap(batch, outbox);
      outbox.go_on_from(batch);
    }
    const Clock::time_point begun = Clock::now();
    send(batch);
    take_requests();
    others.listen();
    queue_keyframes(Clock::now());
    send_chunks();
    if (batch.end_reason) send_end(*batch.end_reason);
    busy_here_s += Seconds(Clock::now() - begun).count();
    batch.clear();
  }
}

// The hand first, then topology, then the state that needs it.
void ServerNet::State::send(Outbox& batch) {
  for (const ContactModel& model : batch.contacts) write(contact_writer, to_wire(model, scene.epoch));
  for (auto& [info, mesh] : batch.new_bodies) add_body(std::move(info), std::move(mesh));
  if (batch.meshes)
    for (std::size_t b = 0; b < shadows.size(); ++b) shadows[b] = {std::move((*batch.meshes)[b]), true, {}};
  for (const BodyDelta& delta : batch.deltas) send_delta(delta);
  if (batch.snapshot_fresh) {
    std::swap(last_snapshot, batch.snapshot);
    any_snapshot = unsent_snapshot = true;
  }
  const bool in_rhythm = Seconds(Clock::now() - state_sent).count() >= state_interval_s;
  if (batch.snapshot_due || (unsent_snapshot && in_rhythm)) send_state();
  for (const Event& event : batch.events)
    write(event_writer, to_wire(SessionEvent{scene.epoch, event.step, static_cast<std::uint8_t>(event.kind),
                                             event.body_id, event.tool_id, event.text}));
  if (Clock::now() >= next_status) send_status(batch);
}

// A viewer that knows the old scene takes the bodies that it doesn't know from the new one. States name all bodies, so
// that nobody draws the parent without its part before the part has come.
void ServerNet::State::add_body(BodyInfo info, TriangleMesh mesh) {
  scene.bodies.push_back(std::move(info));
  shadows.push_back({std::move(mesh), true, {}});
  encoder.add_body();
  write(scene_writer, to_wire(scene));
}

void ServerNet::State::send_delta(const BodyDelta& delta) {
  Shadow& shadow = shadows[delta.body_id];
  const ApplyStatus status = apply(delta.delta, shadow.mesh);
  if (status == ApplyStatus::stale) return;
  if (status != ApplyStatus::applied)
    log_limited(LogLevel::error, "shadow",
                std::string("a delta doesn't fit the published topology: ") + to_string(status));
  encoder.changed(delta.body_id, delta.delta);
  if (!delta_writer.write(to_wire(DeltaMessage{scene.epoch, delta.body_id, delta.delta}))) {
    ++refused_here;
    shadow.keyframe_wanted = true;
  }
}

void ServerNet::State::send_state() {
  unsent_snapshot = false;
  state_sent = Clock::now();
  encoder.encode(last_snapshot);
  write(header_writer, to_wire(encoder.header()));
  for (const StatePiece& piece : encoder.pieces()) write(piece_writer, to_wire(piece));
}

void ServerNet::State::send_status(const Outbox& batch) {
  next_status = Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(kStatusInterval_s));
  ServerStatus status;
  status.epoch = scene.epoch;
  status.step = batch.step;
  status.sim_time_s = static_cast<double>(batch.step) * scene.step_s;
  status.step_wall_time_s = last_snapshot.step_wall_time_s;
  status.stability_margin = batch.report.stability_margin;
  status.cuts_made = batch.report.cuts_made;
  status.cuts_refused = batch.report.cuts_refused;
  status.samples_refused = batch.samples_refused;
  status.viewers = delta_writer.readers();
  status.gravity_target_m_per_s2 = batch.gravity_target_m_per_s2;
  status.bodies = versions();
  status.checks = batch.report.checks;
  write(status_writer, to_wire(status));
}

void ServerNet::State::send_end(const std::string& reason) {
  for (std::uint32_t b = 0; b < shadows.size(); ++b) encoder.refresh(b);
  if (any_snapshot) send_state();
  SessionEnd end{scene.epoch, last_snapshot.step, reason, versions()};
  write(end_writer, to_wire(end));
  {
    const std::lock_guard lock(mutex);
    session_end = std::move(end);
    for (const Shadow& shadow : shadows) copy_bytes += shadow.mesh.bytes();
    for (const auto& body : last_snapshot.bodies) copy_bytes += body.positions_world_m.capacity() * sizeof(Vec3f);
  }
  ended.notify_all();
}

void ServerNet::State::take_requests() {
  wire::KeyframeRequest message;
  while (request_reader.take(message)) {
    const std::optional<KeyframeRequest> request = from_wire(message);
    if (request && request->epoch == scene.epoch && request->body_id < shadows.size())
      shadows[request->body_id].keyframe_wanted = true;
  }
}

void ServerNet::State::queue_keyframes(Clock::time_point now) {
  for (std::uint32_t b = 0; b < shadows.size(); ++b) {
    Shadow& shadow = shadows[b];
    if (!shadow.keyframe_wanted || Seconds(now - shadow.keyframe_sent).count() < kKeyframeInterval_s) continue;
    const bool under_way = std::ranges::any_of(chunks, [&](const KeyframeChunk& c) { return c.body_id == b; });
    if (under_way) continue;
    const std::vector<std::uint8_t> bytes = to_bytes(keyframe_of(shadow.mesh));
    if (bytes.size() > kMaxKeyframeBytes) {
      log_limited(LogLevel::error, "keyframe", "a body is too large for a keyframe: late joiners can't see it");
      continue;
    }
    std::ranges::move(split_keyframe(scene.epoch, b, shadow.mesh.revision(), bytes, chunk_bytes),
                      std::back_inserter(chunks));
    shadow.keyframe_wanted = false;
    shadow.keyframe_sent = now;
  }
}

void ServerNet::State::send_chunks() {
  bool state_wanted = false;
  for (std::size_t i = 0; i < kChunksPerRound && !chunks.empty(); ++i) {
    const KeyframeChunk& chunk = chunks.front();
    write(chunk_writer, to_wire(chunk));
    if (chunk.chunk + 1 == chunk.chunks) {
      encoder.refresh(chunk.body_id);
      state_wanted = true;
    }
    chunks.pop_front();
  }
  // The simulation may be busy or over; whoever joins sees its last state.
  if (state_wanted && any_snapshot) send_state();
}

std::vector<BodyVersion> ServerNet::State::versions() const {
  std::vector<BodyVersion> result;
  for (const Shadow& shadow : shadows) result.push_back({shadow.mesh.revision(), shadow.mesh.hash()});
  return result;
}

ServerNet::ServerNet(const ServerNetOptions& options, SceneInfo scene, std::vector<TriangleMesh> meshes) {
  scene.epoch = options.epoch != 0 ? options.epoch : epoch_now();
  if (scene.world_bodies.empty())
    for (const BodyInfo& body : scene.bodies) scene.world_bodies.push_back(body.name);
  state_ = std::make_unique<State>(options, std::move(scene), std::move(meshes));
}

ServerNet::~ServerNet() = default;

void ServerNet::take_samples(std::vector<ToolSample>& samples) {
  wire::ToolPacket message;
  while (state_->tool_reader.take(message)) {
    const std::optional<ToolPacket> packet = from_wire(message);
    if (!packet) {
      ++state_->damaged_samples;
      continue;
    }
    const std::size_t tools = state_->deduplicator.tools();
    if (packet->tool_id >= tools)
      log_limited(LogLevel::warning, "unknown tool",
                  "a device bridge moves tool " + std::to_string(packet->tool_id) + "; the scene has " +
                      std::to_string(tools) + (tools == 1 ? " tool" : " tools") + ", numbered from 0");
    state_->deduplicator.accept(*packet, samples);
  }
}

std::optional<Vec3> ServerNet::take_gravity() {
  std::optional<Vec3> gravity;
  wire::GravityRequest message;
  while (state_->gravity_reader.take(message)) {
    const std::optional<GravityRequest> request = from_wire(message);
    if (!request || request->source <= state_->last_gravity_source) continue;
    state_->last_gravity_source = request->source;
    gravity = request->gravity_m_per_s2;
  }
  return gravity;
}

void ServerNet::publish(const StepOutput& output, const WorldView& world, double step_wall_time_s) {
  State& s = *state_;
  const Clock::time_point now = Clock::now();
  const bool due = output.publish_now || now >= s.next_state;
  if (due) {
    const auto interval = std::chrono::duration_cast<Clock::duration>(Seconds(s.state_interval_s));
    s.next_state = std::max(s.next_state + interval, now - interval + std::chrono::microseconds(1));
    if (output.publish_now) s.next_state = now + interval;
  }
  bool urgent = false;
  {
    const std::lock_guard lock(s.mutex);
    for (const NewBody& body : output.new_bodies) {
      s.body_infos.push_back(s.body_infos.at(body.parent_id));
      s.body_infos.back().name = body.name;
    }
    s.outbox.put(output, world, s.body_infos, step_wall_time_s, due);
    s.outbox.samples_refused = s.deduplicator.refused() + s.damaged_samples;
    urgent = s.outbox.urgent();
  }
  if (urgent) s.wake.notify_one();
}

SessionEnd ServerNet::end_session(const std::string& reason) {
  std::unique_lock lock(state_->mutex);
  state_->outbox.end_reason = reason;
  state_->wake.notify_one();
  state_->ended.wait(lock, [&] { return state_->session_end.has_value(); });
  return *state_->session_end;
}

const OtherServers& ServerNet::others() const {
  return state_->others;
}

std::size_t ServerNet::copy_bytes() const {
  const std::lock_guard lock(state_->mutex);
  return state_->copy_bytes;
}

double ServerNet::busy_s() const {
  const std::lock_guard lock(state_->mutex);
  return state_->busy_s;
}

std::uint32_t ServerNet::viewers() const {
  return state_->delta_writer.readers();
}

std::uint32_t ServerNet::lost_viewers() const {
  return state_->delta_writer.lost_readers();
}

bool ServerNet::wait_for_viewers_to_leave(double timeout_s) {
  const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(timeout_s));
  while (viewers() > 0 || lost_viewers() > 0) {
    if (Clock::now() >= end) return false;
    std::this_thread::sleep_for(Seconds(kIdle_s));
  }
  return true;
}

std::uint64_t ServerNet::epoch() const {
  return state_->scene.epoch;
}

std::uint64_t ServerNet::writes_refused() const {
  const std::lock_guard lock(state_->mutex);
  return state_->refused;
}

}  // namespace sectio
