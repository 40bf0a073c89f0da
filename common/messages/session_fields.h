// The fields of the messages of session.h, in the order of the wire (fields.h).
#pragma once

#include "common/core/most_gravity.h"
#include "common/messages/fields.h"
#include "common/messages/session.h"

namespace sectio {

constexpr Limits kName = from_to(1, kMaxNameBytes);
constexpr Limits kGravity_m_per_s2 = from_to(-kMostGravity_m_per_s2, kMostGravity_m_per_s2);

template <class Visitor, FieldsOf<RegionPart> M>
void fields(Visitor& visit, M& message) {
  auto& [form, a_m, b_m, radius_a_m, radius_b_m, orientation] = message;
  visit("form", form, at_most(static_cast<double>(RegionForm::tube)));
  visit("a_rest_m", a_m, kPosition_m);
  visit("b_rest_m", b_m, kPosition_m);
  visit("radius_a_m", radius_a_m, kNotNegative);
  visit("radius_b_m", radius_b_m, kNotNegative);
  visit("orientation_wxyz", orientation);
}

template <class Visitor, FieldsOf<Region> M>
void fields(Visitor& visit, M& message) {
  auto& [name, colour, grain_colour, rim_colour, rim_m, ripple_m, stiffness_factor, marked, parts] = message;
  visit("name", name, kName);
  visit("colour_rgb", colour, kColour);
  visit("grain_colour_rgb", grain_colour, kColour);
  visit("rim_colour_rgb", rim_colour, kColour);
  visit("rim_m", rim_m, kNotNegative);
  visit("ripple_m", ripple_m, kNotNegative);
  visit("stiffness_factor", stiffness_factor, kNotNegative);
  visit("marked", marked);
  visit("parts", parts, at_most(kMaxRegionParts));
}

template <class Visitor, FieldsOf<TissueLayer> M>
void fields(Visitor& visit, M& message) {
  auto& [to_depth_m, colour] = message;
  visit("to_depth_m", to_depth_m, kNotNegative);
  visit("colour_rgb", colour, kColour);
}

template <class Visitor, FieldsOf<BodyInfo> M>
void fields(Visitor& visit, M& message) {
  auto& [name, skin_colour, wall_colour, regions, surface, layers] = message;
  visit("name", name, kName);
  visit("skin_colour_rgb", skin_colour, kColour);
  visit("wall_colour_rgb", wall_colour, kColour);
  visit("regions", regions, at_most(kMaxRegions));
  visit("surface", surface, at_most(static_cast<double>(BodySurface::cloth)));
  visit("layers", layers, at_most(kMaxLayers));
}

bool is_consistent(const BodyInfo& body);  // its regions can be drawn: flaw_of(regions)

template <class Visitor, FieldsOf<ToolInfo> M>
void fields(Visitor& visit, M& message) {
  auto& [name, kind, abcd_tool_m, gauge_m] = message;
  visit("name", name, kName);
  visit("kind", kind, kName);
  visit("a_tool_m", abcd_tool_m[0], kPosition_m);
  visit("b_tool_m", abcd_tool_m[1], kPosition_m);
  visit("c_tool_m", abcd_tool_m[2], kPosition_m);
  visit("d_tool_m", abcd_tool_m[3], kPosition_m);
  visit("gauge_m", gauge_m, at_most(1));
}

template <class Visitor, FieldsOf<Camera> M>
void fields(Visitor& visit, M& message) {
  auto& [eye_world_m, target_world_m, up_world, field_of_view_deg] = message;
  visit("eye_world_m", eye_world_m, kPosition_m);
  visit("target_world_m", target_world_m, kPosition_m);
  visit("up_world", up_world, kPosition_m);
  visit("field_of_view_deg", field_of_view_deg, from_to(1, 170));
}

template <class Visitor, FieldsOf<SceneInfo> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, session, step_s, camera, floor_z_m, world_bodies, bodies, tools, task] = message;
  visit("epoch", epoch);
  visit("session", session, kName);
  visit("step_s", step_s, from_to(1e-9, 1));
  visit("camera", camera);
  visit("floor_z_m", floor_z_m, kPosition_m);
  visit("world_bodies", world_bodies, at_most(kMaxBodies), kName);
  visit("bodies", bodies, at_most(kMaxBodies));
  visit("tools", tools, at_most(kMaxTools));
  visit("task", task, at_most(kMaxTaskLines), at_most(kMaxEventTextBytes));
}

template <class Visitor, FieldsOf<SessionEvent> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, step, kind, body_id, tool_id, text] = message;
  visit("epoch", epoch);
  visit("step", step);
  visit("kind", kind);
  visit("body_id", body_id, below(kMaxBodies));
  visit("tool_id", tool_id, below(kMaxTools));
  visit("text", text, at_most(kMaxEventTextBytes));
}

template <class Visitor, FieldsOf<BodyVersion> M>
void fields(Visitor& visit, M& message) {
  auto& [revision, topology_hash] = message;
  visit("revision", revision);
  visit("topology_hash", topology_hash);
}

template <class Visitor, FieldsOf<BodyCheck> M>
void fields(Visitor& visit, M& message) {
  auto& [error_estimate, cpu_estimate, cpu, stability_margin, residual_m, energy_gain_j, implicit_steps, asleep] =
      message;
  visit("error_estimate_1", error_estimate, kNotNegative);
  visit("cpu_estimate_s_per_s", cpu_estimate, kNotNegative);
  visit("cpu_s_per_s", cpu, kNotNegative);
  visit("stability_margin_1", stability_margin, kNotNegative);
  visit("residual_m", residual_m, kNotNegative);
  visit("energy_gain_j", energy_gain_j, kNotNegative);
  visit("implicit_steps_count", implicit_steps);
  visit("is_asleep", asleep);
}

template <class Visitor, FieldsOf<LinkReport> M>
void fields(Visitor& visit, M& message) {
  auto& [client, name, kind, rate_hz, came_per_s, lost_fraction, late_s, age_median_s, age_p99_s, round_trip_s,
         clock_offset_s, sent_s, heard_s] = message;
  visit("client", client);
  visit("name", name, at_most(kMaxNameBytes));
  visit("kind", kind, at_most(static_cast<double>(ProgramKind::hand)));
  visit("rate_hz", rate_hz, kNotNegative);
  visit("came_per_s", came_per_s, kNotNegative);
  visit("lost_fraction_1", lost_fraction, from_to(0, 1));
  visit("late_s", late_s, kNotNegative);
  visit("age_median_s", age_median_s, kNotNegative);
  visit("age_p99_s", age_p99_s, kNotNegative);
  visit("round_trip_s", round_trip_s, kNotNegative);
  visit("clock_offset_s", clock_offset_s);
  visit("sent_s", sent_s);
  visit("heard_s", heard_s);
}

template <class Visitor, FieldsOf<ServerStatus> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, step, sim_time_s, step_wall_time_s, stability_margin, cuts_made, cuts_refused, samples_refused, viewers,
         bodies, gravity_target_m_per_s2, checks, link_reports, speed, sent_s, frozen_tools, speed_set, ends_s] =
      message;
  visit("epoch", epoch);
  visit("step", step);
  visit("sim_time_s", sim_time_s);
  visit("step_wall_time_s", step_wall_time_s, kNotNegative);
  visit("stability_margin_1", stability_margin);
  visit("cuts_made_count", cuts_made);
  visit("cuts_refused_count", cuts_refused);
  visit("samples_refused_count", samples_refused);
  visit("viewers_count", viewers);
  visit("bodies", bodies, at_most(kMaxBodies));
  visit("gravity_target_world_m_per_s2", gravity_target_m_per_s2, kGravity_m_per_s2);
  visit("checks", checks, at_most(kMaxBodies));
  visit("link_reports", link_reports, at_most(kMaxLinkReports));
  visit("speed_1", speed, from_to(0, kFastest));
  visit("sent_s", sent_s);
  visit("frozen_tools", frozen_tools);
  visit("speed_set_1", speed_set, from_to(0, kFastest));
  visit("ends_s", ends_s, kNotNegative);
}

template <class Visitor, FieldsOf<SessionOrder> M>
void fields(Visitor& visit, M& message) {
  auto& [source, kind, gravity_m_per_s2, speed, sim_time_s, tool_id] = message;
  visit("source", source);
  visit("kind", kind, at_most(static_cast<double>(OrderKind::thaw)));
  visit("gravity_world_m_per_s2", gravity_m_per_s2, kGravity_m_per_s2);
  visit("speed_1", speed, from_to(kSlowest, kFastest));
  visit("sim_time_s", sim_time_s, kNotNegative);
  visit("tool_id", tool_id, below(kMaxTools));
}

template <class Visitor, FieldsOf<SessionEnd> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, step, reason, bodies] = message;
  visit("epoch", epoch);
  visit("step", step);
  visit("reason", reason, at_most(kMaxNameBytes));
  visit("bodies", bodies, at_most(kMaxBodies));
}

}  // namespace sectio
