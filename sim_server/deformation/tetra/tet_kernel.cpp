#include "sim_server/deformation/tetra/tet_kernel.h"

#include "common/core/error.h"
#include "sim_server/deformation/tetra/tet_loop.h"

namespace sectio {
namespace {

TetLoopInput input(const TetRows& rows, std::span<const Vec4f> position_world_m) {
  TetLoopInput in;
  in.slices = rows.slices().data();
  in.slice_count = rows.slices().size();
  in.edges = rows.edges().data();
  in.faces = rows.faces().data();
  in.alike_faces = rows.alike_faces().data();
  in.blocks = rows.blocks().data();
  in.pressure_scale = rows.pressure_scale().data();
  // Only the loops whose caller passed writable positions write them.
  in.position = const_cast<char*>(reinterpret_cast<const char*>(position_world_m.data()));
  return in;
}

const TetLoops& loops(SimdWidth width) {
  return has_sixteen_lanes(width) ? kTetLoopsAvx512 : kTetLoopsAvx2;
}

}  // namespace

float update_pressures(const TetRows& rows, bool with_bound, std::span<Vec4f> position_world_m, SimdWidth width) {
  TetLoopInput in = input(rows, position_world_m);
  in.with_bound = with_bound;
  in.step_s = rows.step_s();
  return loops(width).pressures(in);
}

VelocityOutcome update_velocities(const TetRows& rows, const VelocityUpdate& update,
                                  std::span<const Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                                  SimdWidth width) {
  TetLoopInput in = input(rows, position_world_m);
  in.velocity = reinterpret_cast<char*>(velocity_m_per_s.data());
  in.damping_factor = update.damping_factor;
  for (int i = 0; i < 3; ++i) in.gravity_step[i] = update.gravity_step[i];
  in.max_speed_m_per_s = update.max_speed_m_per_s;
  return loops(width).velocities(in);
}

float descend(const TetRows& rows, float step_s, std::span<const Vec4f> inertial_world_m,
              std::span<Vec4f> position_world_m, std::span<float> scratch, SimdWidth width) {
  SECTIO_ASSERT(scratch.size() >= 3 * kLanes * rows.most_faces(), "room for the normals of the widest slice");
  TetLoopInput in = input(rows, position_world_m);
  in.inertial = reinterpret_cast<const char*>(inertial_world_m.data());
  in.scratch = scratch.data();
  // c = h^2 / m from what the rows hold, h_rows / m
  in.step_s = step_s * step_s / rows.step_s();
  return loops(width).descent(in);
}

}  // namespace sectio
