#include "sim_server/net/played_world.h"

#include <algorithm>
#include <utility>

#include "common/dds/qos.h"
#include "common/delta/keyframe.h"
#include "common/messages/codec.h"
#include "common/messages/epoch.h"

namespace sectio {

template <class Message>
bool PlayedWorld::take_if(const McapReader::Message& message) {
  if (message.topic != qos_of<Message>().name) return false;
  if (auto decoded = decode<Message>(message.bytes)) take(std::move(*decoded));
  return true;
}

void PlayedWorld::take(const McapReader::Message& message) {
  take_if<StatePiece>(message) || take_if<StateHeader>(message) || take_if<ScalarPiece>(message) ||
      take_if<DeltaMessage>(message) || take_if<KeyframeChunk>(message) || take_if<SceneInfo>(message) ||
      take_if<SessionEvent>(message) || take_if<ServerStatus>(message) || take_if<SessionEnd>(message);
}

PlayedWorld::Body* PlayedWorld::find(std::uint64_t epoch, std::uint32_t body_id, std::uint32_t& index) {
  const auto server = servers_.find(name_of_session(epoch));
  if (server == servers_.end() || body_id >= server->second.bodies.size()) return nullptr;
  index = server->second.bodies[body_id];
  return &bodies_[index];
}

void PlayedWorld::take(const SceneInfo& scene) {
  if (scene_.session.empty()) scene_ = scene;
  if (scene.tools.size() > scene_.tools.size()) scene_.tools = scene.tools;
  Server& server = servers_[name_of_session(scene.epoch)];
  for (std::size_t b = server.bodies.size(); b < scene.bodies.size() && bodies_.size() < kMaxBodies; ++b) {
    server.bodies.push_back(static_cast<std::uint32_t>(bodies_.size()));
    bodies_.push_back({});
    bodies_.back().info = scene.bodies[b];
  }
}

void PlayedWorld::take(KeyframeChunk chunk) {
  std::uint32_t index = 0;
  Body* body = find(chunk.epoch, chunk.body_id, index);
  if (body == nullptr) return;
  auto& assembler = servers_[name_of_session(chunk.epoch)].assembler;
  const auto bytes = assembler.add(std::move(chunk));
  std::optional<Keyframe> keyframe = bytes ? keyframe_from_bytes(*bytes) : std::nullopt;
  if (!keyframe || (body->is_known && keyframe->revision <= body->mesh.revision())) return;
  std::optional<TriangleMesh> mesh = mesh_of(std::move(*keyframe));
  if (!mesh) return;
  has_jumped_ = has_jumped_ || body->is_known;
  if (!body->is_known) news_.new_bodies.push_back({index, 0, body->info.name});
  body->mesh = std::move(*mesh);
  body->is_known = true;
  make_room(*body);
  std::ranges::fill(body->changed_at, std::uint64_t{0});
  for (const auto& [number, piece] : std::exchange(body->early, {})) place(*body, piece);
}

void PlayedWorld::take(const DeltaMessage& message) {
  std::uint32_t index = 0;
  Body* body = find(message.epoch, message.body_id, index);
  if (body == nullptr || !body->is_known || apply(message.delta, body->mesh) != ApplyStatus::applied) return;
  make_room(*body);
  for (const VertexEdit& edit : message.delta.vertices) {
    if (edit.id >= body->changed_at.size()) continue;
    body->changed_at[edit.id] = message.delta.revision;
    body->is_placed[edit.id] = false;
  }
  news_.deltas.push_back({index, message.delta});
}

void PlayedWorld::make_room(Body& body) {
  body.positions_world_m.resize(body.mesh.vertex_slots(), Vec3f::Zero());
  body.changed_at.resize(body.mesh.vertex_slots(), 0);
  body.is_placed.resize(body.mesh.vertex_slots(), false);
}

void PlayedWorld::take(const StateHeader& header) {
  has_state_ = has_new_state_ = true;
  news_.step = std::max(news_.step, header.step);
  news_.sim_time_s = static_cast<double>(news_.step) * scene_.step_s;
  news_.gravity_m_per_s2 = header.gravity_m_per_s2;
  view_.in_contact = header.in_contact;
  view_.tool_poses_world.assign(scene_.tools.size(), std::nullopt);
  for (std::size_t t = 0; t < std::min(header.tools.size(), scene_.tools.size()); ++t)
    if (header.tools[t].present) view_.tool_poses_world[t] = header.tools[t].pose_world;
  for (std::uint32_t b = 0, index = 0; b < header.bodies.size(); ++b)
    if (Body* body = find(header.epoch, b, index)) body->shown_scalars = header.bodies[b].scalars;
}

void PlayedWorld::take(const StatePiece& piece) {
  std::uint32_t index = 0;
  Body* body = find(piece.epoch, piece.body_id, index);
  if (body == nullptr) return;
  if (body->is_known)
    place(*body, piece);
  else
    body->early.insert_or_assign(piece.piece, piece);
}

void PlayedWorld::place(Body& body, const StatePiece& piece) {
  const std::size_t first = std::size_t{piece.piece} * kVerticesPerPiece;
  for (std::uint32_t i = 0; i < piece.vertices() && first + i < body.positions_world_m.size(); ++i) {
    if (body.changed_at[first + i] > piece.revision) continue;
    body.positions_world_m[first + i] = piece.position_m(i);
    body.is_placed[first + i] = true;
  }
}

void PlayedWorld::take(const ScalarPiece& piece) {
  std::uint32_t index = 0;
  Body* body = find(piece.epoch, piece.body_id, index);
  if (body == nullptr) return;
  ScalarField& field = body->scalars[piece.name];
  field.name = piece.name;
  field.least = piece.least;
  field.most = piece.most;
  const std::size_t first = std::size_t{piece.piece} * kVerticesPerPiece;
  field.values.resize(std::max(body->positions_world_m.size(), field.values.size()), piece.least);
  for (std::size_t i = 0; i < piece.levels.size() && first + i < field.values.size(); ++i)
    field.values[first + i] = from_level(piece.levels[i], piece.least, piece.most);
}

void PlayedWorld::take(const SessionEvent& event) {
  std::uint32_t index = 0;
  if (find(event.epoch, event.body_id, index) == nullptr) return;
  news_.events.push_back({event.step, static_cast<EventKind>(event.kind), index, event.tool_id, event.text});
}

void PlayedWorld::take(const ServerStatus& status) {
  news_.report.stability_margin = status.stability_margin;
  news_.report.cuts_made = status.cuts_made;
  news_.report.cuts_refused = status.cuts_refused;
  news_.gravity_target_m_per_s2 = status.gravity_target_m_per_s2;
  news_.report.checks.resize(bodies_.size());
  for (std::uint32_t b = 0, index = 0; b < status.checks.size(); ++b)
    if (find(status.epoch, b, index) != nullptr) news_.report.checks[index] = status.checks[b];
}

void PlayedWorld::take(const SessionEnd& end) {
  for (std::uint32_t b = 0, index = 0; b < end.bodies.size(); ++b)
    if (find(end.epoch, b, index) != nullptr) ends_[index] = end.bodies[b];
}

bool PlayedWorld::can_be_shown() const {
  return has_state_ && !bodies_.empty() && std::ranges::all_of(bodies_, &Body::is_known);
}

void PlayedWorld::forget_news() {
  news_.deltas.clear();
  news_.new_bodies.clear();
  news_.events.clear();
  has_new_state_ = has_jumped_ = false;
}

void PlayedWorld::forget_deltas() {
  news_.deltas.clear();
  news_.new_bodies.clear();
  has_jumped_ = false;
}

SceneInfo PlayedWorld::scene() const {
  SceneInfo scene = scene_;
  scene.bodies.clear();
  for (const Body& body : bodies_) scene.bodies.push_back(body.info);
  return scene;
}

std::vector<TriangleMesh> PlayedWorld::meshes() const {
  std::vector<TriangleMesh> meshes;
  for (const Body& body : bodies_) meshes.push_back(body.mesh);
  return meshes;
}

// A vertex whose own position hasn't come yet is where a neighbour is, or at rest.
void PlayedWorld::place_all(Body& body) {
  for (VertexId v = 0; v < body.mesh.vertex_slots(); ++v) {
    if (body.is_placed[v] || !body.mesh.vertex_alive(v)) continue;
    body.positions_world_m[v] = body.mesh.rest_body_m(v).cast<float>();
    for (const TriangleId t : body.mesh.fan(v))
      for (const VertexId w : body.mesh.triangle(t).v)
        if (body.is_placed[w]) body.positions_world_m[v] = body.positions_world_m[w];
  }
}

const WorldView& PlayedWorld::view() {
  view_.bodies.clear();
  for (Body& body : bodies_) {
    place_all(body);
    view_.bodies.push_back({&body.mesh, body.positions_world_m});
  }
  view_.scalars = [this](std::uint32_t b) {
    std::vector<ScalarField> fields;
    for (const std::string& name : bodies_[b].shown_scalars) {
      const auto field = bodies_[b].scalars.find(name);
      if (field == bodies_[b].scalars.end()) continue;
      fields.push_back(field->second);
      fields.back().values.resize(bodies_[b].mesh.vertex_slots(), field->second.least);
    }
    return fields;
  };
  return view_;
}

bool PlayedWorld::differs_from_end() const {
  return std::ranges::any_of(ends_, [&](const auto& end) {
    const TriangleMesh& mesh = bodies_[end.first].mesh;
    return BodyVersion{mesh.revision(), mesh.hash()} != end.second;
  });
}

}  // namespace sectio
