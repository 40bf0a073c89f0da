// One valid message of every kind, with no field at its default.
#pragma once

#include "common/messages/chunks.h"
#include "common/messages/contact.h"
#include "common/messages/inputs_fields.h"
#include "common/messages/session.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"
#include "common/messages/topology.h"

namespace sectio::test {

inline Pose some_pose() {
  return {Vec3(0.1, -0.2, 0.3), Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
}

inline ToolPacket some_packet() {
  return {77, 1, {{0, 5, 0.005, some_pose(), 0.1}, {0, 6, 0.006, some_pose(), 0.4}}};
}

inline StepInputs some_inputs() {
  StepRecord first{8, 99, 98, {some_packet()}, {2}, true, true, Vec3(0, -3, -9), "reduced"}, second;
  second.step = 9;
  return {7, 7, {first, second}};
}

inline StepRequest some_step_request() {
  return {7, 3, 42};
}

inline ToolWish some_wish() {
  return {77, 1, 5, {some_pose(), 0.4}, false};
}

inline ContactMessage some_contact() {
  ContactMessage message{7, {}};
  ContactModel& model = message.model;
  model.tool_id = 2;
  model.sequence = 9;
  model.sim_time_s = 1.5;
  model.tool_time_s = 1.4;
  model.state = ContactState::penetration;
  model.force_world_n = Vec3(0, 0, 2);
  model.lever_world_m = Vec3(0, 0.01, 0.02);
  model.point_world_m = Vec3(1, 2, 3);
  model.normal_world = Vec3(0, 0.6, 0.8);
  model.velocity_world_m_per_s = Vec3(0.1, 0, 0);
  model.stiffness_n_per_m = 300;
  model.damping_n_s_per_m = 1.5;
  model.mass_kg = 0.01;
  model.soft_depth_m = 0.002;
  model.side_stiffness_n_per_m = 100;
  model.friction = 0.3;
  model.yield_n = 5;
  return message;
}

inline DeltaMessage some_delta() {
  DeltaMessage message{7, 1, {}};
  message.delta = {4, 5, 99, 10, 12, true, {{3, true, Vec3(1, 2, 3)}, {8, false, Vec3::Zero()}}, {}};
  message.delta.triangles = {{0, {{1, 2, 3}, Surface::wall}}, {4, {}}};
  return message;
}

inline KeyframeChunk some_chunk() {
  return {7, 1, 5, 10, 1, 3, {1, 2, 3, 4}};
}

inline StateHeader some_header() {
  StateHeader header{7, 100, 0.1, 0.002, true, {{true, {some_pose(), 0.4}}}, {}};
  header.bodies = {{5, 400, {0b101}, {"wetness", "damage"}}};
  header.gravity_m_per_s2 = Vec3(3, 0, -9);
  header.sent_s = 17.5;
  return header;
}

inline StatePiece some_piece() {
  return {7, 100, 5, 1, 2, 4 * kQuantum_m, {1, -2, 3}, {0, 1, 2, 65535, 4, 5}};
}

inline ScalarPiece some_scalars() {
  return {7, 100, 5, 1, 2, "temperature", 20, 90, {0, 1, 65535}};
}

inline KeyframeRequest some_request() {
  return {7, 1, 5, 42, 6, 32, 64};
}

inline SessionOrder some_order() {
  return {7, OrderKind::set_speed, Vec3(3, 0, -9), 0.5};
}

inline SceneInfo some_scene() {
  SceneInfo scene;
  scene.epoch = 7;
  scene.session = "theatre";
  scene.step_s = 0.002;
  scene.camera = {Vec3(1, 2, 3), Vec3(0, 0.1, 0), Vec3(0, 1, 0), 50};
  scene.floor_z_m = -0.03;
  scene.world_bodies = {"kidney", "liver"};
  scene.bodies = {{"liver", Vec3(0.1, 0.2, 0.3), Vec3(1, 0, 1)}};
  Region tumour{"tumour", Vec3(0.8, 0.7, 0.5), Vec3(0.6, 0.5, 0.4), Vec3(0.9, 0.9, 0.8), 0.001, 0.0004, 3, true, {}};
  tumour.parts = {{RegionForm::ellipsoid, Vec3(0.01, 0, 0), Vec3(0.01, 0.02, 0.01), 0, 0, some_pose().orientation},
                  {RegionForm::tube, Vec3(0, 0, 0), Vec3(0, 0, 0.1), 0.002, 0.001, {1, 0, 0, 0}}};
  scene.bodies[0].regions = {tumour};
  scene.bodies[0].surface = BodySurface::plastic;
  scene.bodies[0].layers = {{0.002, Vec3(0.9, 0.7, 0.6)}, {0, Vec3(0.9, 0.8, 0.4)}};
  scene.tools = {{"left", "cautery_hook", {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}, 0.008}};
  return scene;
}

inline SessionEvent some_event() {
  return {7, 100, 3, 1, 2, "cut ended"};
}

inline LinkReport some_report() {
  return {42, "screen", ProgramKind::hand, 20, 19.5, 0.1, 0.03, 0.02, 0.05, 0.004, -7, 100, 93};
}

inline ServerStatus some_status() {
  return {7,
          100,
          0.1,
          0.002,
          1.3,
          4,
          1,
          2,
          3,
          {{5, 99}},
          Vec3(3, 0, -9),
          {{0.1, 0.2, 0.3, 1.5, 1e-6, 1e-5, 9, true}},
          {some_report()},
          0,
          77.5,
          5,
          0.25,
          12};
}

inline SessionEnd some_end() {
  return {7, 100, "duration", {{5, 99}}};
}

// Calls use(message) with each of them.
template <class Use>
void for_each_message(const Use& use) {
  use(some_packet());
  use(some_wish());
  use(some_contact());
  use(some_delta());
  use(some_chunk());
  use(some_request());
  use(some_header());
  use(some_piece());
  use(some_scalars());
  use(some_scene());
  use(some_event());
  use(some_status());
  use(some_report());
  use(some_order());
  use(some_end());
  use(some_inputs());
  use(some_step_request());
}
constexpr int kMessages = 17;

}  // namespace sectio::test
