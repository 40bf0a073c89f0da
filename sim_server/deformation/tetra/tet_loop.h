// The loops of tet_kernel.h, written once for registers of 8 and of 16 lanes; simd.h and spring_loop.h have the rules.
#pragma once

#include <algorithm>

#include "sim_server/deformation/simd.h"
#include "sim_server/deformation/spring_loop.h"
#include "sim_server/deformation/tetra/tet_kernel.h"

namespace sectio {

// The arguments of the kernels as plain data.
struct TetLoopInput {
  const TetSlice* slices = nullptr;
  std::size_t slice_count = 0;
  const TetEdgeColumn* edges = nullptr;
  const TetFaceColumn* faces = nullptr;
  const TetAlikeFace* alike_faces = nullptr;
  const TetBlockColumn* blocks = nullptr;
  char* position = nullptr;  // {x y z p}, by byte offset
  char* velocity = nullptr;
  const char* inertial = nullptr;
  const float* pressure_scale = nullptr;  // by vertex
  float* scratch = nullptr;
  float damping_factor = 1;
  float gravity_step[3] = {0, 0, 0};
  float max_speed_m_per_s = 0;
  float step_s = 0;
  bool with_bound = false;
};

struct TetLoops {
  float (*pressures)(const TetLoopInput& in);
  VelocityOutcome (*velocities)(const TetLoopInput& in);
  float (*descent)(const TetLoopInput& in);
};
extern const TetLoops kTetLoopsAvx2, kTetLoopsAvx512;

template <class R>
[[gnu::always_inline]] inline float largest_lane(typename R::Reg a, int count) {
  alignas(64) float lanes[R::kWidth];
  R::store(lanes, a);
  float most = 0;
  for (int i = 0; i < count; ++i) most = lanes[i] > most ? lanes[i] : most;
  return most;
}

template <class R>
[[gnu::always_inline]] inline Lanes3<R> minus(const Lanes4<R>& a, const Lanes4<R>& b) {
  return {R::sub(a.x, b.x), R::sub(a.y, b.y), R::sub(a.z, b.z)};
}
template <class R>
struct TetFaceLanes {
  Lanes4<R> a, b, c;
  Lanes3<R> n;
};
template <class R>
[[gnu::always_inline]] inline TetFaceLanes<R> gather_face(const char* position, const TetFaceColumn& column,
                                                          int first) {
  TetFaceLanes<R> face;
  face.a = gather4<R>(position, &column.a[first]);
  face.b = gather4<R>(position, &column.b[first]);
  face.c = gather4<R>(position, &column.c[first]);
  face.n = cross<R>(minus<R>(face.b, face.a), minus<R>(face.c, face.a));
  return face;
}

// The neighbours of rows: gathered anew for each face, or, where the rows of a slice are alike, once.
template <class R>
struct GatheredFaces {
  const TetLoopInput& in;
  int first;

  GatheredFaces(const TetLoopInput& input, const TetSlice&, int first_lane) : in(input), first(first_lane) {}
  [[gnu::always_inline]] Lanes3<R> edge(const TetSlice&, std::uint32_t e) const {
    return gather<R>(in.position, &in.edges[e].offset[first]);
  }
  [[gnu::always_inline]] TetFaceLanes<R> face(std::uint32_t f) const {
    return gather_face<R>(in.position, in.faces[f], first);
  }
};
template <class R>
struct AlikeFaces {
  const TetLoopInput& in;
  alignas(64) float lanes[kMostAlikeEdges][4][R::kWidth];

  [[gnu::always_inline]] AlikeFaces(const TetLoopInput& input, const TetSlice& slice, int first) : in(input) {
    for (std::uint32_t e = 0; e < slice.edges; ++e) {
      const Lanes4<R> x = gather4<R>(in.position, &in.edges[slice.first_edge + e].offset[first]);
      R::store(lanes[e][0], x.x);
      R::store(lanes[e][1], x.y);
      R::store(lanes[e][2], x.z);
      R::store(lanes[e][3], x.w);
    }
  }
  [[gnu::always_inline]] Lanes4<R> at(std::uint32_t e) const {
    return {R::load(lanes[e][0]), R::load(lanes[e][1]), R::load(lanes[e][2]), R::load(lanes[e][3])};
  }
  [[gnu::always_inline]] Lanes3<R> edge(const TetSlice& slice, std::uint32_t e) const {
    const Lanes4<R> x = at(e - slice.first_edge);
    return {x.x, x.y, x.z};
  }
  [[gnu::always_inline]] TetFaceLanes<R> face(std::uint32_t f) const {
    const TetAlikeFace& edges = in.alike_faces[f];
    TetFaceLanes<R> face{at(edges.a), at(edges.b), at(edges.c), {}};
    face.n = cross<R>(minus<R>(face.b, face.a), minus<R>(face.c, face.a));
    return face;
  }
};

// p_i / 24 = kappa_i / 24 (sum_e n_e . (x_i - a_e) / sum_e 6 V_e - 1)
template <class R, bool kBound, class Faces>
[[gnu::always_inline]] inline float slice_pressures(const TetLoopInput& in, const TetSlice& slice, int first) {
  using Reg = typename R::Reg;
  const std::uint32_t* const offset = &slice.offset[first];
  const Faces faces(in, slice, first);
  const Lanes4<R> x = gather4<R>(in.position, offset);
  Reg volume = R::all(0), stiffness = R::all(0);
  for (std::uint32_t f = slice.first_face; f != slice.first_face + slice.used_faces; ++f) {
    const TetFaceLanes<R> face = faces.face(f);
    volume = R::add(volume, dot<R>(face.n, minus<R>(x, face.a)));
    if constexpr (kBound) stiffness = R::fma(R::load(&in.blocks[f].bulk[first]), dot<R>(face.n, face.n), stiffness);
  }
  const Reg pressure =
      R::sub(R::mul(R::load(&slice.pressure_scale[first]), volume), R::load(&slice.pressure_shift[first]));
  alignas(64) float lanes[R::kWidth];
  R::store(lanes, pressure);
  const int count = std::min(R::kWidth, static_cast<int>(slice.count) - first);
  for (int i = 0; i < count; ++i) reinterpret_cast<float*>(in.position + offset[i])[3] = lanes[i];
  if constexpr (!kBound) return 0;
  // 4 / m, as step_over_mass holds h / m
  const Reg four_over_mass = R::mul(R::all(4 / in.step_s), R::load(&slice.step_over_mass[first]));
  return largest_lane<R>(R::fma(four_over_mass, stiffness, R::load(&slice.bound[first])), count);
}

template <class R, bool kBound>
[[gnu::always_inline]] inline float tet_pressures(const TetLoopInput& in) {
  float most = 0;
  for (const TetSlice* slice = in.slices; slice != in.slices + in.slice_count; ++slice)
    for (int first = 0; first < static_cast<int>(slice->count); first += R::kWidth) {
      const float bound = slice->alike ? slice_pressures<R, kBound, AlikeFaces<R>>(in, *slice, first)
                                       : slice_pressures<R, kBound, GatheredFaces<R>>(in, *slice, first);
      most = bound > most ? bound : most;
    }
  return most;
}

template <class R, class Faces>
[[gnu::always_inline]] inline Lanes3<R> edge_force(const TetLoopInput& in, const TetSlice& slice, int first,
                                                   const Lanes4<R>& x, const Faces& faces) {
  Lanes3<R> force{R::all(0), R::all(0), R::all(0)};
  for (std::uint32_t e = slice.first_edge; e != slice.first_edge + slice.used_edges; ++e) {
    const Lanes3<R> other = faces.edge(slice, e);
    const auto weight = R::load(&in.edges[e].weight[first]);
    force.x = R::fma(weight, R::sub(other.x, x.x), force.x);
    force.y = R::fma(weight, R::sub(other.y, x.y), force.y);
    force.z = R::fma(weight, R::sub(other.z, x.z), force.z);
  }
  return force;
}

// (mu - mean pressure) / 6 of the element behind a face; all pressures are p / 24.
template <class R>
[[gnu::always_inline]] inline typename R::Reg face_factor(const TetFaceColumn& column, int first,
                                                          const TetFaceLanes<R>& face, typename R::Reg own_pressure) {
  const auto pressures = R::add(R::add(own_pressure, face.a.w), R::add(face.b.w, face.c.w));
  return R::sub(R::load(&column.shear[first]), pressures);
}

template <class R, class Faces>
[[gnu::always_inline]] inline void slice_velocities(const TetLoopInput& in, const TetSlice& slice, int first,
                                                    VelocityOutcome& outcome) {
  const std::uint32_t* const offset = &slice.offset[first];
  const Faces faces(in, slice, first);
  const Lanes4<R> x = gather4<R>(in.position, offset);
  Lanes3<R> force = edge_force<R>(in, slice, first, x, faces);
  for (std::uint32_t f = slice.first_face; f != slice.first_face + slice.used_faces; ++f) {
    const TetFaceLanes<R> face = faces.face(f);
    const auto factor = face_factor<R>(in.faces[f], first, face, x.w);
    force.x = R::fma(factor, face.n.x, force.x);
    force.y = R::fma(factor, face.n.y, force.y);
    force.z = R::fma(factor, face.n.z, force.z);
  }
  const Lanes3<R> v = gather<R>(in.velocity, offset);
  const auto step_over_mass = R::load(&slice.step_over_mass[first]);
  const auto share = R::load(&slice.gravity_share[first]), damping = R::all(in.damping_factor);
  const auto updated = [&](auto f, auto old, float gravity_step) __attribute__((always_inline)) {
    return R::fma(share, R::all(gravity_step), R::fma(step_over_mass, f, R::mul(damping, old)));
  };
  const Lanes3<R> now{updated(force.x, v.x, in.gravity_step[0]), updated(force.y, v.y, in.gravity_step[1]),
                      updated(force.z, v.z, in.gravity_step[2])};
  const int count = std::min(R::kWidth, static_cast<int>(slice.count) - first);
  scatter<R>(limited<R>(now, count, offset, in.max_speed_m_per_s, outcome), in.velocity, offset, count);
}

template <class R>
[[gnu::always_inline]] inline VelocityOutcome tet_velocities(const TetLoopInput& in) {
  VelocityOutcome outcome;
  for (const TetSlice* slice = in.slices; slice != in.slices + in.slice_count; ++slice)
    for (int first = 0; first < static_cast<int>(slice->count); first += R::kWidth) {
      if (slice->alike)
        slice_velocities<R, AlikeFaces<R>>(in, *slice, first, outcome);
      else
        slice_velocities<R, GatheredFaces<R>>(in, *slice, first, outcome);
    }
  return outcome;
}

// x = H^-1 f of a symmetric H, by its adjugate.
template <class R>
struct SymmetricLanes {
  typename R::Reg xx, yy, zz, xy, xz, yz;

  [[gnu::always_inline]] Lanes3<R> solve(const Lanes3<R>& f) const {
    const auto cxx = R::minus_fma(yz, yz, R::mul(yy, zz));
    const auto cxy = R::minus_fma(xy, zz, R::mul(xz, yz));
    const auto cxz = R::minus_fma(xz, yy, R::mul(xy, yz));
    const auto cyy = R::minus_fma(xz, xz, R::mul(xx, zz));
    const auto cyz = R::minus_fma(xx, yz, R::mul(xy, xz));
    const auto czz = R::minus_fma(xy, xy, R::mul(xx, yy));
    const auto scale = R::div(R::all(1), R::fma(xx, cxx, R::fma(xy, cxy, R::mul(xz, cxz))));
    const auto row = [&](auto a, auto b, auto c) __attribute__((always_inline)) {
      return R::mul(scale, R::fma(a, f.x, R::fma(b, f.y, R::mul(c, f.z))));
    };
    return {row(cxx, cxy, cxz), row(cxy, cyy, cyz), row(cxz, cyz, czz)};
  }
};

// When vertex i moves by dx_i, the pressures of the corners m of each element e at i change by
// dp_m / 24 = s_m n_e . dx_i. First the growth n_e . dx_i of every face, which replaces the normals in `scratch`;
// returns the sum for each lane.
template <class R>
[[gnu::always_inline]] inline typename R::Reg grow(std::uint32_t faces, float* scratch, const Lanes3<R>& dx) {
  typename R::Reg sum = R::all(0);
  for (std::uint32_t f = 0; f < faces; ++f, scratch += 3 * R::kWidth) {
    const Lanes3<R> n{R::load(scratch), R::load(scratch + R::kWidth), R::load(scratch + 2 * R::kWidth)};
    const auto growth = dot<R>(n, dx);
    sum = R::add(sum, growth);
    R::store(scratch, growth);
  }
  return sum;
}

// Then adds the change of pressure to the other three corners, eight lanes at a time: the order is the same for every
// R.
template <class R>
[[gnu::always_inline]] inline void spread_pressure(const TetLoopInput& in, const TetSlice& slice, int first, int count,
                                                   const float* scratch) {
  const auto spread = [&](std::uint32_t at, float by) __attribute__((always_inline)) {
    reinterpret_cast<float*>(in.position + at)[3] += in.pressure_scale[at / 16] * by;
  };
  for (int from = 0; from < count; from += 8) {
    const int to = std::min(count, from + 8);
    for (std::uint32_t f = 0; f < slice.faces; ++f) {
      const TetFaceColumn& column = in.faces[slice.first_face + f];
      const std::uint32_t *const a = &column.a[first], *const b = &column.b[first], *const c = &column.c[first];
      const float* const grown = scratch + 3 * R::kWidth * f;
      for (int i = from; i < to; ++i) {
        spread(a[i], grown[i]);
        spread(b[i], grown[i]);
        spread(c[i], grown[i]);
      }
    }
  }
}

// Moves the lanes that begin at `first`: writes their pressures and positions and leaves the growth of their faces in
// `scratch`. Returns the largest |dx|^2.
template <class R>
[[gnu::always_inline]] inline float move_to_minimum(const TetLoopInput& in, const TetSlice& slice, int first, int count,
                                                    float* scratch) {
  using Reg = typename R::Reg;
  const std::uint32_t* const offset = &slice.offset[first];
  const Lanes4<R> x = gather4<R>(in.position, offset);
  const Lanes3<R> y = gather<R>(in.inertial, offset);
  Lanes3<R> force = edge_force<R>(in, slice, first, x, GatheredFaces<R>(in, slice, first));
  const Reg zero = R::all(0);
  SymmetricLanes<R> h{zero, zero, zero, zero, zero, zero};
  for (std::uint32_t f = 0; f < slice.faces; ++f) {
    const std::uint32_t column = slice.first_face + f;
    const TetFaceLanes<R> face = gather_face<R>(in.position, in.faces[column], first);
    const Lanes3<R>& n = face.n;
    const Reg factor = face_factor<R>(in.faces[column], first, face, x.w);
    force = {R::fma(factor, n.x, force.x), R::fma(factor, n.y, force.y), R::fma(factor, n.z, force.z)};
    const Reg bulk = R::load(&in.blocks[column].bulk[first]);
    const Lanes3<R> b{R::mul(bulk, n.x), R::mul(bulk, n.y), R::mul(bulk, n.z)};
    h = {R::fma(b.x, n.x, h.xx), R::fma(b.y, n.y, h.yy), R::fma(b.z, n.z, h.zz),
         R::fma(b.x, n.y, h.xy), R::fma(b.x, n.z, h.xz), R::fma(b.y, n.z, h.yz)};
    float* const normal = scratch + 3 * R::kWidth * f;
    R::store(normal, n.x);
    R::store(normal + R::kWidth, n.y);
    R::store(normal + 2 * R::kWidth, n.z);
  }
  // (m / h^2 + H) dx = m / h^2 (y - x) + f, times h^2 / m, which is finite for a fixed vertex, too.
  const Reg c = R::mul(R::all(in.step_s), R::load(&slice.step_over_mass[first]));
  const Reg diagonal = R::fma(c, R::load(&slice.weight_sum[first]), R::all(1));
  h = {R::fma(c, h.xx, diagonal), R::fma(c, h.yy, diagonal), R::fma(c, h.zz, diagonal),
       R::mul(c, h.xy),           R::mul(c, h.xz),           R::mul(c, h.yz)};
  const Lanes3<R> dx = h.solve({R::fma(c, force.x, R::sub(y.x, x.x)), R::fma(c, force.y, R::sub(y.y, x.y)),
                                R::fma(c, force.z, R::sub(y.z, x.z))});
  const Reg pressure = R::fma(R::load(&slice.pressure_scale[first]), grow<R>(slice.faces, scratch, dx), x.w);
  scatter4<R>({R::add(x.x, dx.x), R::add(x.y, dx.y), R::add(x.z, dx.z), pressure}, in.position, offset, count);
  return largest_lane<R>(dot<R>(dx, dx), count);
}

// All rows of a slice move, then the pressures around them follow: each row sees the others' state before the move.
template <class R>
[[gnu::always_inline]] inline float tet_descent(const TetLoopInput& in) {
  float most = 0;
  for (const TetSlice* slice = in.slices; slice != in.slices + in.slice_count; ++slice) {
    const auto rows = static_cast<int>(slice->count);
    const auto scratch_of = [&](int first) {
      return in.scratch + 3 * slice->faces * static_cast<std::uint32_t>(first);
    };
    for (int first = 0; first < rows; first += R::kWidth) {
      const float moved2 = move_to_minimum<R>(in, *slice, first, std::min(R::kWidth, rows - first), scratch_of(first));
      most = moved2 > most ? moved2 : most;
    }
    for (int first = 0; first < rows; first += R::kWidth)
      spread_pressure<R>(in, *slice, first, std::min(R::kWidth, rows - first), scratch_of(first));
  }
  return most;
}

template <class R>
struct TetLoopsOf {
  [[gnu::flatten]] static float pressures(const TetLoopInput& in) {
    return in.with_bound ? tet_pressures<R, true>(in) : tet_pressures<R, false>(in);
  }
  [[gnu::flatten]] static VelocityOutcome velocities(const TetLoopInput& in) { return tet_velocities<R>(in); }
  [[gnu::flatten]] static float descent(const TetLoopInput& in) { return tet_descent<R>(in); }
};
template <class R>
constexpr TetLoops kTetLoops{TetLoopsOf<R>::pressures, TetLoopsOf<R>::velocities, TetLoopsOf<R>::descent};

}  // namespace sectio
