#include "render_client/replica/replica.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sectio {

void Replica::reset(const SceneInfo& scene) {
  *this = Replica();
  scene_ = scene;
  bodies_.resize(scene.bodies.size());
  recoveries_.resize(scene.bodies.size());
}

void Replica::extend(const SceneInfo& scene) {
  if (!is_of_this_server(scene.epoch) || scene.bodies.size() <= bodies_.size() ||
      scene.tools.size() != scene_->tools.size())
    return;
  scene_ = scene;
  bodies_.resize(scene.bodies.size());
  recoveries_.resize(scene.bodies.size());
  headers_.clear();  // they say nothing about the new bodies
  waiting_since_s_.reset();
}

void Replica::adopt(const SceneInfo& scene) {
  if (scene.bodies.size() < bodies_.size() || scene.tools.size() != scene_->tools.size()) return reset(scene);
  scene_->epoch = scene.epoch;
  extend(scene);
  headers_.clear();
  waiting_since_s_.reset();
  ended_ = false;
  adopted_ = true;
}

// The last changes of the server before may be lost with it, and all of them when the session begins anew.
void Replica::go_back_to(const StateHeader& header) {
  const bool anew = drawn_step_ && header.sim_time_s + kMostLost_s < static_cast<double>(*drawn_step_) * scene_->step_s;
  if (anew) drawn_step_.reset();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const bool is_ahead = bodies_[b].known() && bodies_[b].mesh().revision() > header.bodies[b].revision;
    if (!is_ahead && !anew) continue;
    bodies_[b] = ReplicaBody();
    recoveries_[b] = {};
    drawn_step_.reset();
  }
}

void Replica::follow(const StateHeader& header) {
  if (!is_of_this_server(header.epoch) || header.bodies.size() != bodies_.size()) return;
  if (std::exchange(adopted_, false)) go_back_to(header);
  const bool newest = headers_.empty() || header.step > headers_.rbegin()->first;
  for (std::size_t b = 0; newest && b < bodies_.size(); ++b) recoveries_[b].wanted_revision = header.bodies[b].revision;
}

bool Replica::has_room() const {
  std::size_t bytes = headers_.size() * largest_header_bytes_;
  for (const ReplicaBody& body : bodies_) bytes += body.waiting_bytes();
  return bytes < kMaxWaitingBytes;
}

void Replica::feed(DeltaMessage message) {
  if (!is_of_this_server(message.epoch) || message.body_id >= bodies_.size() || !has_room()) return;
  bodies_[message.body_id].feed(std::move(message.delta), counts_);
}

void Replica::feed_keyframe(std::uint64_t epoch, std::uint32_t body_id, std::span<const std::uint8_t> bytes) {
  if (!is_of_this_server(epoch) || body_id >= bodies_.size()) return;
  std::optional<Keyframe> keyframe = keyframe_from_bytes(bytes);
  if (!keyframe) return;
  const ReplicaBody& body = bodies_[body_id];
  if (body.known() && keyframe->revision <= body.mesh().revision()) return;  // for another viewer
  std::optional<TriangleMesh> mesh = mesh_of(std::move(*keyframe));
  if (mesh) bodies_[body_id].feed(std::move(*mesh), counts_);
}

void Replica::feed(StateHeader header) {
  if (!is_of_this_server(header.epoch) || header.bodies.size() != bodies_.size() ||
      header.tools.size() != scene_->tools.size())
    return;
  // A damaged step number would hide all steps that follow.
  const double expected_s = static_cast<double>(header.step) * scene_->step_s;
  if (std::abs(header.sim_time_s - expected_s) > scene_->step_s) return;
  follow(header);
  if (drawn_step_ && header.step <= *drawn_step_) return;
  for (std::size_t b = 0; b < bodies_.size(); ++b) bodies_[b].expect(header.bodies[b], header.step);
  std::size_t bytes = sizeof(StateHeader);
  for (const BodyState& body : header.bodies) bytes += sizeof(BodyState) + body.pieces_sent.size();
  largest_header_bytes_ = std::max(largest_header_bytes_, bytes);
  const std::uint64_t step = header.step;
  headers_.emplace(step, std::move(header));
  if (headers_.size() > kMaxHeaders || !has_room()) headers_.erase(headers_.begin());
}

void Replica::feed(StatePiece piece) {
  if (!is_of_this_server(piece.epoch) || piece.body_id >= bodies_.size() || !has_room()) return;
  ReplicaBody& body = bodies_[piece.body_id];
  body.feed(std::move(piece));
}

void Replica::feed(ScalarPiece piece) {
  if (!is_of_this_server(piece.epoch) || piece.body_id >= bodies_.size()) return;
  ReplicaBody& body = bodies_[piece.body_id];
  body.feed(std::move(piece));
}

void Replica::feed(const SessionEnd& end) {
  if (!is_of_this_server(end.epoch) || end.bodies.size() != bodies_.size()) return;
  ended_ = true;
  for (std::size_t b = 0; b < bodies_.size(); ++b) recoveries_[b].wanted_revision = end.bodies[b].revision;
}

bool Replica::reachable(const StateHeader& header) const {
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (!bodies_[b].can_reach(header.bodies[b].revision)) return false;
  return true;
}

bool Replica::complete(const StateHeader& header) const {
  return std::ranges::all_of(bodies_, [&](const ReplicaBody& body) { return body.complete(header.step); });
}

bool Replica::frame(double now_s, Frame& frame) {
  if (headers_.empty()) return false;
  if (!waiting_since_s_) waiting_since_s_ = now_s;
  const bool patient = now_s - *waiting_since_s_ < kPatience_s;
  const StateHeader* chosen = nullptr;
  const StateHeader* newest_reachable = nullptr;
  for (auto it = headers_.rbegin(); it != headers_.rend() && chosen == nullptr; ++it) {
    if (!reachable(it->second)) continue;
    if (newest_reachable == nullptr) newest_reachable = &it->second;
    if (complete(it->second)) chosen = &it->second;
  }
  const bool patched = chosen == nullptr;
  if (patched && !patient) chosen = newest_reachable;
  if (chosen == nullptr || !prepare(*chosen)) return false;

  fill(*chosen, frame);
  ++counts_.frames;
  if (patched) ++counts_.patched_frames;
  headers_.erase(headers_.begin());  // the chosen header: prepare() has dropped all before it
  waiting_since_s_.reset();
  return true;
}

// Brings meshes and positions to the header's step; afterwards no older state can be drawn.
bool Replica::prepare(const StateHeader& header) {
  bool arrived = true;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    arrived = bodies_[b].advance(header.bodies[b].revision, counts_) && arrived;
  if (!arrived) return false;
  for (std::size_t b = 0; b < bodies_.size(); ++b) bodies_[b].accept_pieces(header.step, header.bodies[b].scalars);
  drawn_step_ = header.step;
  headers_.erase(headers_.begin(), headers_.find(header.step));
  return std::ranges::all_of(bodies_, [](const ReplicaBody& body) { return body.placed(); });
}

void Replica::fill(const StateHeader& header, Frame& frame) {
  frame.session = scene_->session;
  frame.step = header.step;
  frame.sim_time_s = header.sim_time_s;
  frame.step_wall_time_s = header.step_wall_time_s;
  frame.in_contact = header.in_contact;
  frame.gravity_m_per_s2 = header.gravity_m_per_s2;
  frame.camera = scene_->camera;
  frame.floor_z_m = scene_->floor_z_m;
  frame.bodies.resize(bodies_.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    frame.bodies[b].name = scene_->bodies[b].name;
    frame.bodies[b].skin_colour = scene_->bodies[b].skin_colour;
    frame.bodies[b].wall_colour = scene_->bodies[b].wall_colour;
    frame.bodies[b].regions = scene_->bodies[b].regions;
    frame.bodies[b].surface = scene_->bodies[b].surface;
    frame.bodies[b].layers = scene_->bodies[b].layers;
    bodies_[b].fill(frame.bodies[b]);
  }
  frame.tools.resize(header.tools.size());
  for (std::size_t t = 0; t < header.tools.size(); ++t) {
    const ToolInfo& info = scene_->tools[t];
    frame.tools[t] = {info.name,        info.kind,   header.tools[t].present, header.tools[t].pose_world,
                      info.abcd_tool_m, info.gauge_m};
  }
}

std::vector<KeyframeRequest> Replica::take_requests(double now_s) {
  std::vector<KeyframeRequest> requests;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const ReplicaBody& body = bodies_[b];
    Recovery& recovery = recoveries_[b];
    const bool behind = body.known() && recovery.wanted_revision > body.mesh().revision();
    // After the end no further state comes: the last one may be lost while all deltas are at hand.
    const bool starved = body.stuck() || (behind && (ended_ || !body.can_reach(recovery.wanted_revision)));
    if (!starved) {
      recovery.starved_since_s.reset();
      recovery.interval_s = kRequestInterval_s;
      continue;
    }
    if (!recovery.starved_since_s) recovery.starved_since_s = now_s;
    const bool at_once = !body.known();
    const bool late = now_s - *recovery.starved_since_s >= kPatience_s;
    if (!(at_once || late) || now_s < recovery.next_s) continue;
    recovery.next_s = now_s + recovery.interval_s;
    recovery.interval_s = std::min(2 * recovery.interval_s, kMaxRequestInterval_s);
    KeyframeRequest request;
    request.epoch = scene_->epoch;
    request.body_id = static_cast<std::uint32_t>(b);
    if (body.known()) request.known_revision = body.mesh().revision();
    requests.push_back(request);
    ++counts_.requests;
  }
  return requests;
}

std::vector<BodyVersion> Replica::catch_up() {
  std::vector<BodyVersion> versions;
  for (ReplicaBody& body : bodies_) {
    body.catch_up(counts_);
    versions.push_back({body.mesh().revision(), body.mesh().hash()});
  }
  return versions;
}

}  // namespace sectio
