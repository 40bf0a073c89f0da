#include "common/dds/convert.h"

#include <algorithm>
#include <cmath>

#include "common/dds/convert_parts.h"
#include "common/messages/chunks.h"

namespace sectio {

using namespace convert;

namespace {

template <class Edit, class Slot>
bool ascending(const std::vector<Edit>& edits, Slot slot) {
  return std::ranges::adjacent_find(edits, [&](const Edit& a, const Edit& b) { return slot(a) >= slot(b); }) ==
         edits.end();
}

}  // namespace

wire::ToolPacket to_wire(const ToolPacket& packet) {
  wire::ToolPacket m;
  m.source(packet.source);
  m.tool_id(packet.tool_id);
  m.poses().resize(std::min(packet.samples.size(), kMaxPosesPerPacket));
  const std::size_t first = packet.samples.size() - m.poses().size();
  for (std::size_t i = 0; i < m.poses().size(); ++i) {
    const ToolSample& sample = packet.samples[first + i];
    m.poses()[i].sequence_number(sample.sequence);
    m.poses()[i].tool_time_s(sample.tool_time_s);
    m.poses()[i].position_world_m(triple(sample.pose_world.position_m));
    m.poses()[i].orientation_wxyz(quadruple(sample.pose_world.orientation));
    m.poses()[i].opening_rad(sample.opening_rad);
  }
  return m;
}

std::optional<ToolPacket> from_wire(const wire::ToolPacket& m) {
  if (m.tool_id() >= kMaxTools || m.poses().empty() || m.poses().size() > kMaxPosesPerPacket) return std::nullopt;
  ToolPacket packet{m.source(), m.tool_id(), {}};
  for (const wire::ToolPose& p : m.poses()) {
    const std::optional<Pose> pose = pose_from(p.position_world_m(), p.orientation_wxyz());
    if (!pose || !finite({p.tool_time_s()})) return std::nullopt;
    if (!(p.opening_rad() >= 0 && p.opening_rad() <= kWidestOpening_rad)) return std::nullopt;
    if (!packet.samples.empty() && p.sequence_number() <= packet.samples.back().sequence) return std::nullopt;
    packet.samples.push_back({m.tool_id(), p.sequence_number(), p.tool_time_s(), *pose, p.opening_rad()});
  }
  return packet;
}

wire::ContactModel to_wire(const ContactModel& model, std::uint64_t epoch) {
  wire::ContactModel m;
  m.epoch(epoch);
  m.sequence_number(model.sequence);
  m.tool_id(model.tool_id);
  m.state(static_cast<std::uint8_t>(model.state));
  m.sim_time_s(model.sim_time_s);
  m.tool_time_s(model.tool_time_s);
  m.point_world_m(triple(model.point_world_m));
  m.normal_world(triple(model.normal_world));
  m.velocity_world_m_per_s(triple(model.velocity_world_m_per_s));
  m.force_world_n(triple(model.force_world_n));
  m.tip_world_m(triple(model.tip_world_m));
  m.stiffness_n_per_m(model.stiffness_n_per_m);
  m.tangential_stiffness_n_per_m(model.tangential_stiffness_n_per_m);
  m.damping_n_s_per_m(model.damping_n_s_per_m);
  m.friction_coefficient(model.friction);
  m.yield_n(model.yield_n);
  m.valid_radius_m(model.valid_radius_m);
  m.time_to_live_s(model.time_to_live_s);
  return m;
}

std::optional<ContactMessage> from_wire(const wire::ContactModel& m) {
  if (m.tool_id() >= kMaxTools || m.state() > static_cast<std::uint8_t>(ContactState::penetration) ||
      !finite({m.sim_time_s(), m.tool_time_s()}) || !is_position(m.point_world_m()) || !is_position(m.tip_world_m()) ||
      !vec3(m.velocity_world_m_per_s()).allFinite() || !vec3(m.force_world_n()).allFinite() ||
      !is_unit(vec3(m.normal_world())) ||
      !not_negative({m.stiffness_n_per_m(), m.tangential_stiffness_n_per_m(), m.damping_n_s_per_m(),
                     m.friction_coefficient(), m.yield_n(), m.valid_radius_m(), m.time_to_live_s()}))
    return std::nullopt;
  ContactMessage result{m.epoch(), {}};
  ContactModel& model = result.model;
  model.tool_id = m.tool_id();
  model.sequence = m.sequence_number();
  model.sim_time_s = m.sim_time_s();
  model.tool_time_s = m.tool_time_s();
  model.state = static_cast<ContactState>(m.state());
  model.point_world_m = vec3(m.point_world_m());
  model.normal_world = vec3(m.normal_world());
  model.velocity_world_m_per_s = vec3(m.velocity_world_m_per_s());
  model.force_world_n = vec3(m.force_world_n());
  model.tip_world_m = vec3(m.tip_world_m());
  model.stiffness_n_per_m = m.stiffness_n_per_m();
  model.tangential_stiffness_n_per_m = m.tangential_stiffness_n_per_m();
  model.damping_n_s_per_m = m.damping_n_s_per_m();
  model.friction = m.friction_coefficient();
  model.yield_n = m.yield_n();
  model.valid_radius_m = m.valid_radius_m();
  model.time_to_live_s = m.time_to_live_s();
  return result;
}

wire::TopologyDelta to_wire(const DeltaMessage& message) {
  const TopologyDelta& delta = message.delta;
  wire::TopologyDelta m;
  m.epoch(message.epoch);
  m.body_id(message.body_id);
  m.base_revision(delta.base_revision);
  m.revision(delta.revision);
  m.hash_after(delta.hash_after);
  m.vertex_slots_after(delta.vertex_slots_after);
  m.triangle_slots_after(delta.triangle_slots_after);
  m.temporary(delta.temporary);
  m.vertices().resize(delta.vertices.size());
  for (std::size_t i = 0; i < delta.vertices.size(); ++i) {
    m.vertices()[i].slot(delta.vertices[i].id);
    m.vertices()[i].alive(delta.vertices[i].alive);
    m.vertices()[i].rest_body_m(triple(delta.vertices[i].rest_body_m));
  }
  m.triangles().resize(delta.triangles.size());
  for (std::size_t i = 0; i < delta.triangles.size(); ++i) {
    m.triangles()[i].slot(delta.triangles[i].id);
    m.triangles()[i].corners(delta.triangles[i].triangle.v);
    m.triangles()[i].surface(static_cast<std::uint8_t>(delta.triangles[i].triangle.surface));
  }
  return m;
}

std::optional<DeltaMessage> from_wire(const wire::TopologyDelta& m) {
  if (m.body_id() >= kMaxBodies || m.revision() == 0 || m.base_revision() != m.revision() - 1 ||
      m.vertex_slots_after() > kMaxVertexSlots || m.triangle_slots_after() > kMaxTriangleSlots ||
      !ascending(m.vertices(), [](const wire::VertexEdit& e) { return e.slot(); }) ||
      !ascending(m.triangles(), [](const wire::TriangleEdit& e) { return e.slot(); }))
    return std::nullopt;
  DeltaMessage message{m.epoch(), m.body_id(), {}};
  TopologyDelta& delta = message.delta;
  delta.base_revision = m.base_revision();
  delta.revision = m.revision();
  delta.hash_after = m.hash_after();
  delta.vertex_slots_after = m.vertex_slots_after();
  delta.triangle_slots_after = m.triangle_slots_after();
  delta.temporary = m.temporary();
  delta.vertices.reserve(m.vertices().size());
  for (const wire::VertexEdit& e : m.vertices()) {
    if (e.slot() >= kMaxVertexSlots || !is_position(e.rest_body_m())) return std::nullopt;
    delta.vertices.push_back({e.slot(), e.alive(), vec3(e.rest_body_m())});
  }
  delta.triangles.reserve(m.triangles().size());
  for (const wire::TriangleEdit& e : m.triangles()) {
    if (e.slot() >= kMaxTriangleSlots || e.surface() > static_cast<std::uint8_t>(Surface::wall)) return std::nullopt;
    const Triangle triangle{e.corners(), static_cast<Surface>(e.surface())};
    if (triangle.alive() && std::ranges::any_of(triangle.v, [](VertexId v) { return v >= kMaxVertexSlots; }))
      return std::nullopt;
    delta.triangles.push_back({e.slot(), triangle});
  }
  return message;
}

wire::KeyframeChunk to_wire(const KeyframeChunk& chunk) {
  wire::KeyframeChunk m;
  m.epoch(chunk.epoch);
  m.body_id(chunk.body_id);
  m.revision(chunk.revision);
  m.total_bytes(chunk.total_bytes);
  m.chunk(chunk.chunk);
  m.chunks(chunk.chunks);
  m.bytes(chunk.bytes);
  return m;
}

std::optional<KeyframeChunk> from_wire(const wire::KeyframeChunk& m) {
  const std::uint64_t size = m.bytes().size();
  if (m.body_id() >= kMaxBodies || m.chunks() == 0 || m.chunks() > kMaxChunks || m.chunk() >= m.chunks() || size == 0 ||
      size > kChunkBytes || m.total_bytes() > kMaxKeyframeBytes || m.total_bytes() < m.chunks())
    return std::nullopt;
  // All but the last are of one size, and as many as that size needs.
  if (m.chunk() + 1 < m.chunks() && (m.total_bytes() + size - 1) / size != m.chunks()) return std::nullopt;
  return KeyframeChunk{m.epoch(), m.body_id(), m.revision(), m.total_bytes(), m.chunk(), m.chunks(), m.bytes()};
}

wire::KeyframeRequest to_wire(const KeyframeRequest& request) {
  wire::KeyframeRequest m;
  m.epoch(request.epoch);
  m.body_id(request.body_id);
  m.known_revision(request.known_revision);
  m.client(request.client);
  return m;
}

std::optional<KeyframeRequest> from_wire(const wire::KeyframeRequest& m) {
  if (m.body_id() >= kMaxBodies) return std::nullopt;
  return KeyframeRequest{m.epoch(), m.body_id(), m.known_revision(), m.client()};
}

wire::StateHeader to_wire(const StateHeader& header) {
  wire::StateHeader m;
  m.epoch(header.epoch);
  m.step(header.step);
  m.sim_time_s(header.sim_time_s);
  m.step_wall_time_s(header.step_wall_time_s);
  m.in_contact(header.in_contact);
  m.gravity_world_m_per_s2(triple(header.gravity_m_per_s2));
  m.tools().resize(header.tools.size());
  for (std::size_t i = 0; i < header.tools.size(); ++i) {
    m.tools()[i].present(header.tools[i].present);
    m.tools()[i].position_world_m(triple(header.tools[i].pose_world.position_m));
    m.tools()[i].orientation_wxyz(quadruple(header.tools[i].pose_world.orientation));
    m.tools()[i].opening_rad(header.tools[i].pose_world.opening_rad);
  }
  m.bodies().resize(header.bodies.size());
  for (std::size_t i = 0; i < header.bodies.size(); ++i) {
    m.bodies()[i].revision(header.bodies[i].revision);
    m.bodies()[i].vertex_slots(header.bodies[i].vertex_slots);
    m.bodies()[i].pieces_sent(header.bodies[i].pieces_sent);
  }
  return m;
}

std::optional<StateHeader> from_wire(const wire::StateHeader& m) {
  if (m.tools().size() > kMaxTools || m.bodies().size() > kMaxBodies || !finite({m.sim_time_s()}) ||
      !is_gravity(m.gravity_world_m_per_s2()) || !not_negative({m.step_wall_time_s()}))
    return std::nullopt;
  StateHeader header{m.epoch(),
                     m.step(),
                     m.sim_time_s(),
                     m.step_wall_time_s(),
                     m.in_contact(),
                     {},
                     {},
                     vec3(m.gravity_world_m_per_s2())};
  for (const wire::ToolState& t : m.tools()) {
    const std::optional<Pose> pose = pose_from(t.position_world_m(), t.orientation_wxyz());
    if (!pose || !(t.opening_rad() >= 0 && t.opening_rad() <= kWidestOpening_rad)) return std::nullopt;
    header.tools.push_back({t.present(), {*pose, t.opening_rad()}});
  }
  for (const wire::BodyState& b : m.bodies()) {
    const std::uint32_t pieces = piece_count(b.vertex_slots());
    if (b.vertex_slots() > kMaxVertexSlots || b.pieces_sent().size() != (pieces + 7) / 8) return std::nullopt;
    if (pieces % 8 != 0 && b.pieces_sent().back() >> (pieces % 8) != 0) return std::nullopt;
    header.bodies.push_back({b.revision(), b.vertex_slots(), b.pieces_sent()});
  }
  return header;
}

wire::StatePiece to_wire(const StatePiece& piece) {
  wire::StatePiece m;
  m.epoch(piece.epoch);
  m.step(piece.step);
  m.revision(piece.revision);
  m.body_id(piece.body_id);
  m.piece(piece.piece);
  m.quantum_m(piece.quantum_m);
  m.origin_quanta(piece.origin_quanta);
  m.offsets_quanta(piece.offsets_quanta);
  return m;
}

std::optional<StatePiece> from_wire(const wire::StatePiece& m) {
  const std::size_t size = m.offsets_quanta().size();
  int exponent = 0;
  const double mantissa = std::frexp(m.quantum_m() / kQuantum_m, &exponent);
  if (m.body_id() >= kMaxBodies || m.piece() >= piece_count(kMaxVertexSlots) || size == 0 || size % 3 != 0 ||
      size > 3 * kVerticesPerPiece || !finite({m.quantum_m()}) || mantissa != 0.5 || exponent < 1 || exponent > 16)
    return std::nullopt;
  return StatePiece{m.epoch(), m.step(),      m.revision(),      m.body_id(),
                    m.piece(), m.quantum_m(), m.origin_quanta(), m.offsets_quanta()};
}

}  // namespace sectio
