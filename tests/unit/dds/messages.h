// One valid message of every kind.
#pragma once

#include "common/dds/convert.h"
#include "common/messages/chunks.h"

namespace sectio::test {

inline Pose some_pose() {
  return {Vec3(0.1, -0.2, 0.3), Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
}

inline ToolPacket some_packet() {
  return {77, 1, {{1, 5, 0.005, some_pose()}, {1, 6, 0.006, some_pose(), 0.4}}};
}

inline ContactModel some_model() {
  ContactModel model;
  model.tool_id = 2;
  model.sequence = 9;
  model.sim_time_s = 1.5;
  model.tool_time_s = 1.4;
  model.state = ContactState::penetration;
  model.point_world_m = Vec3(1, 2, 3);
  model.force_world_n = Vec3(0, 0, 2);
  model.stiffness_n_per_m = 300;
  model.friction = 0.3;
  model.yield_n = 5;
  return model;
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
  header.bodies = {{5, 400, {0b101}}};
  header.gravity_m_per_s2 = Vec3(3, 0, -9);
  return header;
}

inline StatePiece some_piece() {
  return {7, 100, 5, 1, 2, kQuantum_m, {1, -2, 3}, {0, 1, 2, 65535, 4, 5}};
}

inline SceneInfo some_scene() {
  SceneInfo scene;
  scene.epoch = 7;
  scene.session = "theatre";
  scene.floor_z_m = -0.03;
  scene.world_bodies = {"kidney", "liver"};
  scene.bodies = {{"liver", Vec3(0.1, 0.2, 0.3), Vec3(1, 0, 1)}};
  Region tumour{"tumour", Vec3(0.8, 0.7, 0.5), Vec3(0.6, 0.5, 0.4), Vec3(0.9, 0.9, 0.8), 0.001, 0.0004, 3, true, {}};
  tumour.parts = {{RegionForm::ellipsoid, Vec3(0.01, 0, 0), Vec3(0.01, 0.02, 0.01), 0, 0, some_pose().orientation},
                  {RegionForm::tube, Vec3(0, 0, 0), Vec3(0, 0, 0.1), 0.002, 0.001, {1, 0, 0, 0}}};
  scene.bodies[0].regions = {tumour};
  scene.tools = {{"left", "cautery_hook", {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}, 0.008}};
  return scene;
}

inline SessionEvent some_event() {
  return {7, 100, 3, 1, 2, "cut ended"};
}

inline ServerStatus some_status() {
  return {7, 100, 0.1, 0.002, 1.3, 4, 1, 2, 3, {{5, 99}}, Vec3(3, 0, -9), {{0.1, 0.2, 0.3, 1.5, 1e-6, 1e-5, 9}}};
}

inline SessionEnd some_end() {
  return {7, 100, "duration", {{5, 99}}};
}

}  // namespace sectio::test
