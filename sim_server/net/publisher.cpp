#include "sim_server/net/publisher.h"

#include <algorithm>
#include <utility>

#include "common/delta/keyframe.h"
#include "common/messages/chunks.h"

namespace sectio {

namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kStatusInterval_s = 0.5;
constexpr double kKeyframeInterval_s = 0.1;  // at most one a body; requests in between are served together
constexpr std::size_t kChunksPerRound = 16;  // between two looks into the outbox: 0.5 MB; off host 19 kB

}  // namespace

Publisher::Publisher(ServerEndpoints& endpoints, SceneInfo scene, std::vector<TriangleMesh> meshes,
                     double state_interval_s, std::uint32_t chunk_bytes)
    : endpoints_(endpoints),
      scene_(std::move(scene)),
      state_interval_s_(state_interval_s),
      chunk_bytes_(chunk_bytes),
      encoder_(scene_.epoch, scene_.step_s, scene_.bodies.size()) {
  for (TriangleMesh& mesh : meshes) shadows_.push_back({std::move(mesh), false, {}});
}

template <class Message>
bool Publisher::write(const Message& message) {
  if (endpoints_.write(message)) return true;
  ++writes_refused_;
  log_limited(LogLevel::warning, "write refused", "DDS refused to send a message");
  return false;
}

void Publisher::announce() {
  write(scene_);
}

void Publisher::send(Outbox& batch) {
  for (const ContactModel& model : batch.contacts) write(ContactMessage{scene_.epoch, model});
  for (auto& [info, mesh] : batch.new_bodies) add_body(std::move(info), std::move(mesh));
  if (batch.meshes)
    for (std::size_t b = 0; b < shadows_.size(); ++b) shadows_[b] = {std::move((*batch.meshes)[b]), true, {}};
  for (const BodyDelta& delta : batch.deltas) send_delta(delta);
  if (batch.snapshot_fresh) {
    std::swap(last_snapshot_, batch.snapshot);
    any_snapshot_ = unsent_snapshot_ = true;
  }
  const bool in_rhythm = Seconds(Clock::now() - state_sent_).count() >= state_interval_s_;
  if (batch.snapshot_due || (unsent_snapshot_ && in_rhythm)) send_state();
  for (const Event& event : batch.events)
    write(SessionEvent{scene_.epoch, event.step, static_cast<std::uint8_t>(event.kind), event.body_id, event.tool_id,
                       event.text});
  if (Clock::now() >= next_status_) send_status(batch);
}

// A viewer that knows the old scene takes the bodies that it doesn't know from the new one. States name all bodies, so
// that no viewer draws the parent without its part before the part has come.
void Publisher::add_body(BodyInfo info, TriangleMesh mesh) {
  scene_.bodies.push_back(std::move(info));
  shadows_.push_back({std::move(mesh), true, {}});
  encoder_.add_body();
  announce();
}

void Publisher::send_delta(const BodyDelta& delta) {
  Shadow& shadow = shadows_[delta.body_id];
  const ApplyStatus status = apply(delta.delta, shadow.mesh);
  if (status == ApplyStatus::stale) return;
  if (status != ApplyStatus::applied)
    log_limited(LogLevel::error, "shadow",
                std::string("a delta doesn't fit the published topology: ") + to_string(status));
  encoder_.changed(delta.body_id, delta.delta);
  if (!write(DeltaMessage{scene_.epoch, delta.body_id, delta.delta})) shadow.keyframe_wanted = true;
}

void Publisher::send_state() {
  unsent_snapshot_ = false;
  state_sent_ = Clock::now();
  encoder_.encode(last_snapshot_);
  write(encoder_.header());
  for (const StatePiece& piece : encoder_.pieces()) write(piece);
  for (const ScalarPiece& piece : encoder_.scalar_pieces()) write(piece);
}

void Publisher::send_status(const Outbox& batch) {
  next_status_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(kStatusInterval_s));
  ServerStatus status;
  status.epoch = scene_.epoch;
  status.step = batch.step;
  status.sim_time_s = static_cast<double>(batch.step) * scene_.step_s;
  status.step_wall_time_s = last_snapshot_.step_wall_time_s;
  status.stability_margin = batch.report.stability_margin;
  status.cuts_made = batch.report.cuts_made;
  status.cuts_refused = batch.report.cuts_refused;
  status.samples_refused = batch.samples_refused;
  status.viewers = endpoints_.writer<DeltaMessage>().readers();
  status.gravity_target_m_per_s2 = batch.gravity_target_m_per_s2;
  status.bodies = versions();
  status.checks = batch.report.checks;
  write(status);
}

SessionEnd Publisher::send_end(const std::string& reason) {
  for (std::uint32_t b = 0; b < shadows_.size(); ++b) encoder_.refresh(b);
  if (any_snapshot_) send_state();
  SessionEnd end{scene_.epoch, last_snapshot_.step, reason, versions()};
  write(end);
  return end;
}

void Publisher::serve_keyframes() {
  take_requests();
  queue_keyframes();
  send_chunks();
}

void Publisher::take_requests() {
  while (const auto request = endpoints_.take<KeyframeRequest>())
    if (request->epoch == scene_.epoch && request->body_id < shadows_.size())
      shadows_[request->body_id].keyframe_wanted = true;
}

void Publisher::queue_keyframes() {
  const Clock::time_point now = Clock::now();
  for (std::uint32_t b = 0; b < shadows_.size(); ++b) {
    Shadow& shadow = shadows_[b];
    if (!shadow.keyframe_wanted || Seconds(now - shadow.keyframe_sent).count() < kKeyframeInterval_s) continue;
    const bool under_way = std::ranges::any_of(chunks_, [&](const KeyframeChunk& c) { return c.body_id == b; });
    if (under_way) continue;
    const std::vector<std::uint8_t> bytes = to_bytes(keyframe_of(shadow.mesh));
    if (bytes.size() > kMaxKeyframeBytes) {
      log_limited(LogLevel::error, "keyframe", "a body is too large for a keyframe: late joiners can't see it");
      continue;
    }
    std::ranges::move(split_keyframe(scene_.epoch, b, shadow.mesh.revision(), bytes, chunk_bytes_),
                      std::back_inserter(chunks_));
    shadow.keyframe_wanted = false;
    shadow.keyframe_sent = now;
  }
}

void Publisher::send_chunks() {
  bool state_wanted = false;
  for (std::size_t i = 0; i < kChunksPerRound && !chunks_.empty(); ++i) {
    const KeyframeChunk& chunk = chunks_.front();
    write(chunk);
    if (chunk.chunk + 1 == chunk.chunks) {
      encoder_.refresh(chunk.body_id);
      state_wanted = true;
    }
    chunks_.pop_front();
  }
  // The simulation may be busy or over; a viewer that joins sees its last state.
  if (state_wanted && any_snapshot_) send_state();
}

std::vector<BodyVersion> Publisher::versions() const {
  std::vector<BodyVersion> result;
  for (const Shadow& shadow : shadows_) result.push_back({shadow.mesh.revision(), shadow.mesh.hash()});
  return result;
}

std::size_t Publisher::copy_bytes() const {
  std::size_t sum = 0;
  for (const Shadow& shadow : shadows_) sum += shadow.mesh.bytes();
  for (const auto& body : last_snapshot_.bodies) sum += body.positions_world_m.capacity() * sizeof(Vec3f);
  return sum;
}

}  // namespace sectio
