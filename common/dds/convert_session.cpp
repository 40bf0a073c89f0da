// Messages of idl/session.idl.
#include <utility>

#include "common/dds/convert.h"
#include "common/dds/convert_parts.h"

namespace sectio {

using namespace convert;

namespace {

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

std::vector<wire::Region> regions_to_wire(const Regions& regions) {
  std::vector<wire::Region> result;
  for (const Region& region : regions) {
    wire::Region& m = result.emplace_back();
    m.name(region.name);
    m.colour_rgb(triple(region.colour));
    m.grain_colour_rgb(triple(region.grain_colour));
    m.rim_colour_rgb(triple(region.rim_colour));
    m.rim_m(region.rim_m);
    m.ripple_m(region.ripple_m);
    m.stiffness_factor(region.stiffness_factor);
    m.marked(region.marked);
    for (const RegionPart& part : region.parts) {
      wire::RegionPart& p = m.parts().emplace_back();
      p.form(static_cast<std::uint8_t>(part.form));
      p.a_rest_m(triple(part.a_m));
      p.b_rest_m(triple(part.b_m));
      p.radius_a_m(part.radius_a_m);
      p.radius_b_m(part.radius_b_m);
      p.orientation_wxyz(quadruple(part.orientation));
    }
  }
  return result;
}

std::optional<Regions> regions_from(const std::vector<wire::Region>& regions) {
  Regions result;
  for (const wire::Region& m : regions) {
    const std::optional<std::string> name = text_from(m.name(), 1);
    if (!name) return std::nullopt;
    Region& region = result.emplace_back();
    region = {*name,     vec3(m.colour_rgb()), vec3(m.grain_colour_rgb()), vec3(m.rim_colour_rgb()),
              m.rim_m(), m.ripple_m(),         m.stiffness_factor(),       m.marked(),
              {}};
    for (const wire::RegionPart& p : m.parts()) {
      const std::optional<Pose> pose = pose_from(p.a_rest_m(), p.orientation_wxyz());
      if (!pose || p.form() > static_cast<std::uint8_t>(RegionForm::tube)) return std::nullopt;
      region.parts.push_back({static_cast<RegionForm>(p.form()), pose->position_m, vec3(p.b_rest_m()), p.radius_a_m(),
                              p.radius_b_m(), pose->orientation});
    }
  }
  if (!flaw_of(result).empty()) return std::nullopt;
  return result;
}

}  // namespace

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
    m.bodies()[i].regions(regions_to_wire(scene.bodies[i].regions));
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
    std::optional<Regions> regions = regions_from(b.regions());
    if (!name || !regions || !is_colour(b.skin_colour_rgb()) || !is_colour(b.wall_colour_rgb())) return std::nullopt;
    scene.bodies.push_back({*name, vec3(b.skin_colour_rgb()), vec3(b.wall_colour_rgb()), std::move(*regions)});
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
  m.gravity_target_world_m_per_s2(triple(status.gravity_target_m_per_s2));
  m.bodies(versions_to_wire(status.bodies));
  m.checks().resize(status.checks.size());
  for (std::size_t i = 0; i < status.checks.size(); ++i) {
    const BodyCheck& from = status.checks[i];
    wire::BodyCheck& to = m.checks()[i];
    to.error_estimate_1(from.error_estimate);
    to.cpu_estimate_s_per_s(from.cpu_estimate);
    to.cpu_s_per_s(from.cpu);
    to.stability_margin_1(from.stability_margin);
    to.residual_m(from.residual_m);
    to.energy_gain_j(from.energy_gain_j);
    to.implicit_steps_count(from.implicit_steps);
    to.is_asleep(from.asleep);
  }
  return m;
}

std::optional<ServerStatus> from_wire(const wire::ServerStatus& m) {
  std::vector<BodyCheck> checks;
  for (const wire::BodyCheck& c : m.checks()) {
    if (!not_negative({c.error_estimate_1(), c.cpu_estimate_s_per_s(), c.cpu_s_per_s(), c.stability_margin_1(),
                       c.residual_m(), c.energy_gain_j()}))
      return std::nullopt;
    checks.push_back({c.error_estimate_1(), c.cpu_estimate_s_per_s(), c.cpu_s_per_s(), c.stability_margin_1(),
                      c.residual_m(), c.energy_gain_j(), c.implicit_steps_count(), c.is_asleep()});
  }
  if (m.bodies().size() > kMaxBodies || m.checks().size() > kMaxBodies ||
      !is_gravity(m.gravity_target_world_m_per_s2()) || !finite({m.sim_time_s(), m.stability_margin_1()}) ||
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
                      versions_from(m.bodies()),
                      vec3(m.gravity_target_world_m_per_s2()),
                      std::move(checks)};
}

wire::GravityRequest to_wire(const GravityRequest& request) {
  wire::GravityRequest m;
  m.source(request.source);
  m.gravity_world_m_per_s2(triple(request.gravity_m_per_s2));
  return m;
}

std::optional<GravityRequest> from_wire(const wire::GravityRequest& m) {
  if (!is_gravity(m.gravity_world_m_per_s2())) return std::nullopt;
  return GravityRequest{m.source(), vec3(m.gravity_world_m_per_s2())};
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
