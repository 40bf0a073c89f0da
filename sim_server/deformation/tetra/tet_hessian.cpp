#include "sim_server/deformation/tetra/tet_hessian.h"

#include "sim_server/deformation/tetra/tet_hessian_loop.h"

namespace sectio {
namespace {

TetHessianInput hessian_input(const TetRows& rows) {
  TetHessianInput in;
  in.slices = rows.slices().data();
  in.slice_count = rows.slices().size();
  in.edges = rows.edges().data();
  in.faces = rows.faces().data();
  in.face_edges = rows.face_edges().data();
  in.pressure_scale = rows.pressure_scale().data();
  return in;
}

// Only the loops whose caller passed writable memory write it.
char* bytes(std::span<const Vec4f> entries) {
  return const_cast<char*>(reinterpret_cast<const char*>(entries.data()));
}

const TetHessianLoops& hessian_loops(SimdWidth width) {
  return has_sixteen_lanes(width) ? kTetHessianLoopsAvx512 : kTetHessianLoopsAvx2;
}

}  // namespace

void TetHessian::resize(const TetRows& rows) {
  resize_slots(columns, rows.edges().size(), TetHessianColumn{});
  resize_slots(slices, rows.slices().size(), TetHessianSlice{});
  std::uint32_t most_edges = 0;
  for (const TetSlice& slice : rows.slices()) most_edges = std::max(most_edges, slice.edges);
  scratch.resize(kBytesAtEdge * kLanes * most_edges / sizeof(TetEdgeColumn) + 1);
}

void update_pressures(const TetRows& rows, std::span<Vec4f> position_world_m, std::span<const Vec4f> low_m,
                      SimdWidth width) {
  TetHessianInput in = hessian_input(rows);
  in.position = bytes(position_world_m);
  in.low = bytes(low_m);
  hessian_loops(width).pressures(in);
}

void elastic_forces(const TetRows& rows, std::span<const Vec4f> position_world_m, std::span<const Vec4f> low_m,
                    std::span<Vec4f> force_n, SimdWidth width) {
  TetHessianInput in = hessian_input(rows);
  in.position = bytes(position_world_m);
  in.low = bytes(low_m);
  in.force = bytes(force_n);
  hessian_loops(width).forces(in);
}

void linearise(const TetRows& rows, std::span<const Vec4f> position_world_m, TetHessian& hessian, SimdWidth width) {
  hessian.resize(rows);
  TetHessianInput in = hessian_input(rows);
  in.position = bytes(position_world_m);
  in.columns = hessian.columns.data();
  in.blocks = hessian.slices.data();
  in.scratch = reinterpret_cast<char*>(hessian.scratch.data());
  hessian_loops(width).linearise(in);
}

void add_product(const TetRows& rows, const TetHessian& hessian, std::span<Vec4f> p_m, std::span<Vec4f> force_n,
                 SimdWidth width) {
  TetHessianInput in = hessian_input(rows);
  in.position = bytes(p_m);
  in.force = bytes(force_n);
  in.columns = const_cast<TetHessianColumn*>(hessian.columns.data());
  in.blocks = const_cast<TetHessianSlice*>(hessian.slices.data());
  hessian_loops(width).product(in);
}

}  // namespace sectio
