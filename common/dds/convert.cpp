#include "common/dds/convert.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>

#include "common/messages/chunks.h"

namespace sectio {

namespace {

using Triple = std::array<double, 3>;

Triple triple(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

Vec3 vec3(const Triple& t) {
  return {t[0], t[1], t[2]};
}

std::array<double, 4> quadruple(const Eigen::Quaterniond& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

bool finite(std::initializer_list<double> values) {
  return std::ranges::all_of(values, [](double x) { return std::isfinite(x); });
}

bool not_negative(std::initializer_list<double> values) {
  return std::ranges::all_of(values, [](double x) { return std::isfinite(x) && x >= 0; });
}

bool is_position(const Triple& t) {
  return std::ranges::all_of(t, [](double x) { return std::abs(x) <= kMaxCoordinate_m; });
}

bool is_colour(const Triple& t) {
  return std::ranges::all_of(t, [](double x) { return x >= 0 && x <= 1; });
}

bool is_unit(const Vec3& v) {
  return std::abs(v.norm() - 1) < 1e-3;
}

std::optional<Pose> pose_from(const Triple& position_m, const std::array<double, 4>& wxyz) {
  Pose pose{vec3(position_m), Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3])};
  if (!is_position(position_m) || !(std::abs(pose.orientation.norm() - 1) < 1e-3)) return std::nullopt;
  // Rounding must not grow from hop to hop: what is normalised already stays as it is, bit for bit.
  if (std::abs(pose.orientation.squaredNorm() - 1) > 1e-12) pose.orientation.normalize();
  return pose;
}

template <std::size_t N>
std::optional<std::string> text_from(const eprosima::fastrtps::fixed_string<N>& fixed, std::size_t min_bytes) {
  std::string text = fixed.c_str();
  const bool printable = std::ranges::all_of(text, [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
  if (text.size() < min_bytes || !printable) return std::nullopt;
  return text;
}

std::vector<wire::BodyVersion> versions_to_wire(const std::vector<BodyVersion>& bodies) {
  std::vector<wire::BodyVersion> result(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    result[i].revision(bodies[i].revision);
    result[i].topology_hash(bodies[i].topology_hash);
  }
  return result;
}

std::vector<BodyVersion> versions_from(const std::vector<wire::BodyVersion>& bodies) {
  std::vector<BodyVersion> result;
  result.reserve(bodies.size());
  for (const wire::BodyVersion& body : bodies) result.push_back({body.revision(), body.topology_hash()});
  return result;
}

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
      !not_negative({m.step_wall_time_s()}))
    return std::nullopt;
  StateHeader header{m.epoch(), m.step(), m.sim_time_s(), m.step_wall_time_s(), m.in_contact(), {}, {}};
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

wire::SceneInfo to_wire(const SceneInfo& scene) {
  wire::SceneInfo m;
  m.epoch(scene.epoch);
  m.session(scene.session);
  m.step_s(scene.step_s);
  m.camera_eye_world_m(triple(scene.camera.eye_world_m));
  m.camera_target_world_m(triple(scene.camera.target_world_m));
  m.camera_up_world(triple(scene.camera.up_world));
  m.camera_field_of_view_deg(scene.camera.field_of_view_deg);
  m.has_floor(scene.floor_z_m.has_value());
  m.floor_z_m(scene.floor_z_m.value_or(0));
  m.world_bodies().resize(scene.world_bodies.size());
  for (std::size_t i = 0; i < scene.world_bodies.size(); ++i) m.world_bodies()[i].name(scene.world_bodies[i]);
  m.bodies().resize(scene.bodies.size());
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    m.bodies()[i].name(scene.bodies[i].name);
    m.bodies()[i].skin_colour_rgb(triple(scene.bodies[i].skin_colour));
    m.bodies()[i].wall_colour_rgb(triple(scene.bodies[i].wall_colour));
  }
  m.tools().resize(scene.tools.size());
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const auto& [a, b, c, d] = scene.tools[i].abcd_tool_m;
    m.tools()[i].name(scene.tools[i].name);
    m.tools()[i].kind(scene.tools[i].kind);
    m.tools()[i].a_tool_m(triple(a));
    m.tools()[i].b_tool_m(triple(b));
    m.tools()[i].c_tool_m(triple(c));
    m.tools()[i].d_tool_m(triple(d));
    m.tools()[i].gauge_m(scene.tools[i].gauge_m);
  }
  return m;
}

std::optional<SceneInfo> from_wire(const wire::SceneInfo& m) {
  const std::optional<std::string> session = text_from(m.session(), 1);
  if (!session || m.world_bodies().size() > kMaxBodies || m.bodies().size() > kMaxBodies ||
      m.tools().size() > kMaxTools || !(m.step_s() > 0) || !(m.step_s() <= 1) || !is_position(m.camera_eye_world_m()) ||
      !is_position(m.camera_target_world_m()) || !is_position(m.camera_up_world()) ||
      !(m.camera_field_of_view_deg() >= 1) || !(m.camera_field_of_view_deg() <= 170) ||
      !is_position({0, 0, m.floor_z_m()}))
    return std::nullopt;
  SceneInfo scene;
  scene.epoch = m.epoch();
  scene.session = *session;
  scene.step_s = m.step_s();
  if (m.has_floor()) scene.floor_z_m = m.floor_z_m();
  scene.camera = {vec3(m.camera_eye_world_m()), vec3(m.camera_target_world_m()), vec3(m.camera_up_world()),
                  m.camera_field_of_view_deg()};
  for (const wire::BodyName& b : m.world_bodies()) {
    const std::optional<std::string> name = text_from(b.name(), 1);
    if (!name) return std::nullopt;
    scene.world_bodies.push_back(*name);
  }
  for (const wire::BodyInfo& b : m.bodies()) {
    const std::optional<std::string> name = text_from(b.name(), 1);
    if (!name || !is_colour(b.skin_colour_rgb()) || !is_colour(b.wall_colour_rgb())) return std::nullopt;
    scene.bodies.push_back({*name, vec3(b.skin_colour_rgb()), vec3(b.wall_colour_rgb())});
  }
  for (const wire::ToolInfo& t : m.tools()) {
    const std::optional<std::string> name = text_from(t.name(), 1), kind = text_from(t.kind(), 1);
    if (!name || !kind || !is_position(t.a_tool_m()) || !is_position(t.b_tool_m()) || !is_position(t.c_tool_m()) ||
        !is_position(t.d_tool_m()) || !(t.gauge_m() >= 0 && t.gauge_m() <= 1))
      return std::nullopt;
    scene.tools.push_back(
        {*name, *kind, {vec3(t.a_tool_m()), vec3(t.b_tool_m()), vec3(t.c_tool_m()), vec3(t.d_tool_m())}, t.gauge_m()});
  }
  return scene;
}

wire::Event to_wire(const SessionEvent& event) {
  wire::Event m;
  m.epoch(event.epoch);
  m.step(event.step);
  m.kind(event.kind);
  m.body_id(event.body_id);
  m.tool_id(event.tool_id);
  m.text(event.text);
  return m;
}

std::optional<SessionEvent> from_wire(const wire::Event& m) {
  const std::optional<std::string> text = text_from(m.text(), 0);
  if (!text || m.body_id() >= kMaxBodies || m.tool_id() >= kMaxTools) return std::nullopt;
  return SessionEvent{m.epoch(), m.step(), m.kind(), m.body_id(), m.tool_id(), *text};
}

wire::ServerStatus to_wire(const ServerStatus& status) {
  wire::ServerStatus m;
  m.epoch(status.epoch);
  m.step(status.step);
  m.sim_time_s(status.sim_time_s);
  m.step_wall_time_s(status.step_wall_time_s);
  m.stability_margin_1(status.stability_margin);
  m.cuts_made_count(status.cuts_made);
  m.cuts_refused_count(status.cuts_refused);
  m.samples_refused_count(status.samples_refused);
  m.viewers_count(status.viewers);
  m.bodies(versions_to_wire(status.bodies));
  return m;
}

std::optional<ServerStatus> from_wire(const wire::ServerStatus& m) {
  if (m.bodies().size() > kMaxBodies || !finite({m.sim_time_s(), m.stability_margin_1()}) ||
      !not_negative({m.step_wall_time_s()}))
    return std::nullopt;
  return ServerStatus{m.epoch(),
                      m.step(),
                      m.sim_time_s(),
                      m.step_wall_time_s(),
                      m.stability_margin_1(),
                      m.cuts_made_count(),
                      m.cuts_refused_count(),
                      m.samples_refused_count(),
                      m.viewers_count(),
                      versions_from(m.bodies())};
}

wire::SessionEnd to_wire(const SessionEnd& end) {
  wire::SessionEnd m;
  m.epoch(end.epoch);
  m.step(end.step);
  m.reason(end.reason);
  m.bodies(versions_to_wire(end.bodies));
  return m;
}

std::optional<SessionEnd> from_wire(const wire::SessionEnd& m) {
  const std::optional<std::string> reason = text_from(m.reason(), 0);
  if (!reason || m.bodies().size() > kMaxBodies) return std::nullopt;
  return SessionEnd{m.epoch(), m.step(), *reason, versions_from(m.bodies())};
}

}  // namespace sectio
