#include "sim_server/net/publisher.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/core/wall_time.h"

namespace sectio {

namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kStatusInterval_s = 0.5;
constexpr double kReportLife_s = 3;
constexpr double kMostUnsent_s = 0.25;  // deltas wait so long for a state
constexpr std::size_t kMostUnsentSlots = 1u << 16;
constexpr std::size_t kPiecesAtOnce = 24;      // 28 kB of a state
constexpr double kSpread = 0.8;                // share of a stream's interval over which the others are spread,
constexpr double kMostPieces_per_s = 10000;    // or longer: 12 MB/s; a state waits for the one before
constexpr double kMostRefreshed_per_s = 3500;  // 4 MB/s, as for keyframes

LinkReport heard_now(LinkReport report) {
  report.heard_s = steady_now_s();
  return report;
}

// The slower streams leave out small motion, up to a fifth of a millimetre, which is a pixel.
constexpr std::array<StateEncoder::Fineness, kStateRates_hz.size()> kFineness{{{60, 1}, {40, 2}, {24, 10}, {10, 40}}};

}  // namespace

Publisher::Publisher(ServerEndpoints& endpoints, SceneInfo scene, std::vector<TriangleMesh> meshes,
                     double state_interval_s, bool off_host, SessionRecord* record)
    : endpoints_(endpoints),
      scene_(std::move(scene)),
      record_(record),
      off_host_(off_host),
      keyframes_(scene_.epoch, off_host) {
  for (TriangleMesh& mesh : meshes) shadows_.push_back({std::move(mesh), false});
  for (std::size_t i = 0; i < kStateRates_hz.size(); ++i) {
    Stream& stream = streams_.emplace_back();
    stream.interval_s = i == 0 ? state_interval_s : 1 / kStateRates_hz[i];
    stream.fineness = kFineness[i];
    if (off_host_)
      stream.fineness.most_refreshed = static_cast<std::uint32_t>(kMostRefreshed_per_s * stream.interval_s);
    stream.encoder = new_encoder(stream);
  }
}

StateEncoder Publisher::new_encoder(const Stream& stream) const {
  return {scene_.epoch, scene_.step_s, shadows_.size(), stream.fineness};
}

// A record holds the finest stream of states.
template <class Message>
bool Publisher::write(const Message& message, std::size_t channel) {
  if (record_ && channel == 0) record_->add(message);
  if (endpoints_.write(message, channel)) return true;
  ++writes_refused_;
  log_limited(LogLevel::warning, "write refused", "DDS refused to send a message");
  return false;
}

void Publisher::announce() {
  write(scene_);
}

// For readers that begin at this place of a record.
void Publisher::keep_keyframes() {
  send_deltas();
  keyframes_kept_s_ = record_->time_s();
  record_->add(scene_);
  for (std::uint32_t b = 0; b < shadows_.size(); ++b) record_->add_keyframe(scene_.epoch, b, shadows_[b].mesh);
}

void Publisher::send(Outbox& batch) {
  if (record_) {
    record_->set_time(static_cast<double>(batch.step) * scene_.step_s);
    for (const StepRecord& step : batch.inputs) record_->add(StepInputs{scene_.epoch, step.step - 1, {step}});
    if (record_->time_s() >= keyframes_kept_s_ + kKeyframesKeptEvery_s) keep_keyframes();
    for (const ContactModel& model : batch.contacts) record_->add(ContactMessage{scene_.epoch, model});
  }
  for (auto& [info, mesh] : batch.new_bodies) add_body(std::move(info), std::move(mesh));
  if (batch.meshes)
    for (std::size_t b = 0; b < shadows_.size(); ++b) shadows_[b] = {std::move((*batch.meshes)[b]), true};
  if (record_ && (batch.meshes || !batch.new_bodies.empty())) keep_keyframes();
  for (const BodyDelta& delta : batch.deltas) take(delta);
  if (batch.snapshot_fresh) {
    std::swap(last_snapshot_, batch.snapshot);
    any_snapshot_ = true;
    for (Stream& stream : streams_) stream.unsent = true;
  }
  look_for_readers();
  send_states(batch.snapshot_due);
  send_old_deltas();
  for (const Event& event : batch.events) send_event(event);
  if (Clock::now() >= next_status_) send_status(batch);
}

void Publisher::send_event(const Event& event) {
  write(SessionEvent{scene_.epoch, event.step, static_cast<std::uint8_t>(event.kind), event.body_id, event.tool_id,
                     event.text});
}

void Publisher::repeat(std::span<const BodyDelta> deltas, std::span<const Event> events) {
  for (const BodyDelta& delta : deltas) write(DeltaMessage{scene_.epoch, delta.body_id, delta.delta});
  for (const Event& event : events) send_event(event);
}

// A viewer that knows the old scene takes the bodies that it doesn't know from the new one. States name all bodies, so
// that no viewer draws the parent without its part before the part has come.
void Publisher::add_body(BodyInfo info, TriangleMesh mesh) {
  scene_.bodies.push_back(std::move(info));
  shadows_.push_back({std::move(mesh), true});
  for (Stream& stream : streams_) stream.encoder.add_body();
  announce();
}

void Publisher::take(const BodyDelta& delta) {
  Shadow& shadow = shadows_[delta.body_id];
  if (delta.delta.revision <= shadow.mesh.revision()) return;
  if (shadow.unsent.slots() > kMostUnsentSlots) send_delta(delta.body_id);
  if (shadow.unsent.empty()) shadow.unsent_since = Clock::now();
  if (!shadow.unsent.add(delta.delta, shadow.mesh)) {
    send_delta(delta.body_id);
    shadow.unsent_since = Clock::now();
    static_cast<void>(shadow.unsent.add(delta.delta, shadow.mesh));
  }
  if (const ApplyStatus status = apply(delta.delta, shadow.mesh); status != ApplyStatus::applied)
    log_limited(LogLevel::error, "shadow",
                std::string("a delta doesn't fit the published topology: ") + to_string(status));
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (is_heard(i)) streams_[i].encoder.changed(delta.body_id, delta.delta);
}

void Publisher::send_delta(std::uint32_t body_id) {
  Shadow& shadow = shadows_[body_id];
  if (shadow.unsent.empty()) return;
  if (!write(DeltaMessage{scene_.epoch, body_id, shadow.unsent.take()})) shadow.keyframe_wanted = true;
}

void Publisher::send_deltas() {
  for (std::uint32_t b = 0; b < shadows_.size(); ++b) send_delta(b);
}

// No state takes them along when nobody hears any.
void Publisher::send_old_deltas() {
  for (std::uint32_t b = 0; b < shadows_.size(); ++b)
    if (Seconds(Clock::now() - shadows_[b].unsent_since).count() > kMostUnsent_s) send_delta(b);
}

// A viewer that begins to hear a stream lacks all pieces.
void Publisher::look_for_readers() {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    Stream& stream = streams_[i];
    const std::uint32_t readers = endpoints_.writer<StateHeader>().readers(i);
    const std::uint32_t before = std::exchange(stream.readers, readers);
    if (readers <= before) continue;
    if (before == 0 && !(record_ && i == 0)) {
      stream.encoder = new_encoder(stream);
      stream.pieces_sent = 0;
    }
    for (std::uint32_t b = 0; b < shadows_.size(); ++b) stream.encoder.refresh(b);
    if (any_snapshot_) send_state(i);
  }
}

void Publisher::send_states(bool at_once) {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const Stream& stream = streams_[i];
    const bool due = (i == 0 && at_once) || Seconds(Clock::now() - stream.sent).count() >= stream.interval_s;
    if (stream.unsent && due && stream.pieces_sent == stream.pieces()) send_state(i);
  }
}

void Publisher::send_state(std::size_t channel, bool whole) {
  Stream& stream = streams_[channel];
  send_pieces(channel, stream.pieces());
  stream.unsent = false;
  stream.sent = Clock::now();
  if (!is_heard(channel)) return;
  send_deltas();
  stream.encoder.encode(last_snapshot_, whole);
  stream.unsent = stream.encoder.is_refreshing();
  stream.pieces_sent = 0;
  StateHeader header = stream.encoder.header();
  header.sent_s = steady_now_s();
  write(header, channel);
  send_pieces_that_are_due(channel);
}

void Publisher::send_pieces(std::size_t channel, std::size_t end) {
  Stream& stream = streams_[channel];
  const std::span<const StatePiece> pieces = stream.encoder.pieces();
  for (std::size_t& n = stream.pieces_sent; n < end; ++n)
    if (n < pieces.size())
      write(pieces[n], channel);
    else
      write(stream.encoder.scalar_pieces()[n - pieces.size()], channel);
}

void Publisher::send_pieces_that_are_due(std::size_t channel) {
  const Stream& stream = streams_[channel];
  const std::size_t all = stream.pieces();
  const double per_s = std::min(kMostPieces_per_s, static_cast<double>(all) / (kSpread * stream.interval_s));
  const double due = static_cast<double>(kPiecesAtOnce) + per_s * Seconds(Clock::now() - stream.sent).count();
  send_pieces(channel, off_host_ && due < static_cast<double>(all) ? static_cast<std::size_t>(due) : all);
}

bool Publisher::has_more_to_send() const {
  return keyframes_.has_chunks_left() ||
         std::ranges::any_of(streams_, [](const Stream& each) { return each.pieces_sent < each.pieces(); });
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
  status.viewers = writer_to_viewers(endpoints_).readers();
  status.gravity_target_m_per_s2 = batch.gravity_target_m_per_s2;
  status.speed = batch.speed;
  status.speed_set = batch.speed_set;
  status.ends_s = batch.ends_s;
  status.frozen_tools = batch.frozen_tools;
  status.bodies = versions();
  status.checks = batch.report.checks;
  for (const auto& [program, report] : reports_) status.link_reports.push_back(report.report);
  status.sent_s = steady_now_s();
  write(status);
}

SessionEnd Publisher::send_end(const std::string& reason) {
  send_deltas();
  for (std::size_t i = 0; i < streams_.size() && any_snapshot_; ++i) {
    send_state(i, true);
    send_pieces(i, streams_[i].pieces());
  }
  SessionEnd end{scene_.epoch, last_snapshot_.step, reason, versions()};
  write(end);
  return end;
}

void Publisher::serve_viewers() {
  look_for_readers();
  take_requests();
  take_reports();
  begin_keyframes();
  const auto write_chunk = [&](const KeyframeChunk& chunk) { return write(chunk); };
  for (const std::uint32_t body_id : keyframes_.send_chunks(write_chunk))
    for (Stream& stream : streams_) {
      stream.encoder.refresh(body_id);
      stream.unsent = any_snapshot_;
    }
  for (std::size_t i = 0; i < streams_.size(); ++i) send_pieces_that_are_due(i);
  // The simulation may be busy or over; a viewer that joins sees its last state.
  send_states(false);
}

void Publisher::take_requests() {
  while (const auto request = endpoints_.take<KeyframeRequest>()) {
    if (request->epoch != scene_.epoch || request->body_id >= shadows_.size()) continue;
    if (!keyframes_.go_on(*request, endpoints_.sender<KeyframeRequest>()))
      shadows_[request->body_id].keyframe_wanted = true;
  }
}

void Publisher::take_reports() {
  while (auto report = endpoints_.take<LinkReport>()) {
    const ProgramId& program = endpoints_.sender<LinkReport>();
    const bool is_of_another = std::ranges::any_of(reports_, [&](const auto& each) {
      return each.second.report.client == report->client && each.first != program;
    });
    if (!is_of_another && (reports_.size() < kMaxLinkReports || reports_.contains(program)))
      reports_[program] = {heard_now(std::move(*report)), Clock::now()};
  }
  std::erase_if(reports_,
                [](const auto& each) { return Seconds(Clock::now() - each.second.heard).count() > kReportLife_s; });
}

void Publisher::begin_keyframes() {
  for (std::uint32_t b = 0; b < shadows_.size(); ++b) {
    if (!shadows_[b].keyframe_wanted) continue;
    send_delta(b);  // the next one begins where the keyframe ends
    if (keyframes_.begin(b, shadows_[b].mesh)) shadows_[b].keyframe_wanted = false;
  }
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
