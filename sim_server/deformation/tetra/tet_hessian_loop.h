// The loops of tet_hessian.h, written once for registers of 8 and of 16 lanes; simd.h and spring_loop.h have the rules.
#pragma once

#include <algorithm>

#include "sim_server/deformation/simd.h"
#include "sim_server/deformation/tetra/tet_hessian.h"

namespace sectio {

// The arguments as plain data.
struct TetHessianInput {
  const TetSlice* slices = nullptr;
  std::size_t slice_count = 0;
  const TetEdgeColumn* edges = nullptr;
  const TetFaceColumn* faces = nullptr;
  const TetFaceEdges* face_edges = nullptr;
  const float* pressure_scale = nullptr;  // by vertex
  char* position = nullptr;               // {x y z p / 24}, or a direction {x y z q}, by byte offset
  const char* low = nullptr;
  char* force = nullptr;
  TetHessianColumn* columns = nullptr;
  TetHessianSlice* blocks = nullptr;
  char* scratch = nullptr;  // for each lane and edge: sums of n_j, c (edge opposite), n_i
};

struct TetHessianLoops {
  void (*pressures)(const TetHessianInput& in);
  void (*forces)(const TetHessianInput& in);
  void (*linearise)(const TetHessianInput& in);
  void (*product)(const TetHessianInput& in);
};
extern const TetHessianLoops kTetHessianLoopsAvx2, kTetHessianLoopsAvx512;

template <class R>
[[gnu::always_inline]] inline Lanes3<R> load3(const std::array<std::array<float, kLanes>, 3>& a, int first) {
  return {R::load(&a[0][first]), R::load(&a[1][first]), R::load(&a[2][first])};
}
template <class R>
[[gnu::always_inline]] inline void store3(std::array<std::array<float, kLanes>, 3>& a, int first, const Lanes3<R>& v) {
  R::store(&a[0][first], v.x);
  R::store(&a[1][first], v.y);
  R::store(&a[2][first], v.z);
}
template <class R>
[[gnu::always_inline]] inline Lanes3<R> difference(const Lanes3<R>& a, const Lanes3<R>& b) {
  return {R::sub(a.x, b.x), R::sub(a.y, b.y), R::sub(a.z, b.z)};
}
template <class R>
[[gnu::always_inline]] inline Lanes3<R> times(typename R::Reg k, const Lanes3<R>& v) {
  return {R::mul(k, v.x), R::mul(k, v.y), R::mul(k, v.z)};
}
template <class R>
[[gnu::always_inline]] inline Lanes3<R> sum(const Lanes3<R>& a, const Lanes3<R>& b) {
  return {R::add(a.x, b.x), R::add(a.y, b.y), R::add(a.z, b.z)};
}
// k v + a
template <class R>
[[gnu::always_inline]] inline Lanes3<R> plus(typename R::Reg k, const Lanes3<R>& v, const Lanes3<R>& a) {
  return {R::fma(k, v.x, a.x), R::fma(k, v.y, a.y), R::fma(k, v.z, a.z)};
}
template <class R>
[[gnu::always_inline]] inline Lanes3<R> nothing() {
  return {R::all(0), R::all(0), R::all(0)};
}

// A corner of a face as seen from the vertex of the row, and its pressure.
template <class R>
struct TetCornerLanes {
  Lanes3<R> at;
  typename R::Reg pressure;
};

// Differences of what is high are exact where they matter, so that rounding is that of differences.
template <class R, bool kExact>
[[gnu::always_inline]] inline TetCornerLanes<R> corner_from(const TetHessianInput& in, const std::uint32_t* offset,
                                                            const Lanes4<R>& x, const Lanes3<R>& low) {
  const Lanes4<R> a = gather4<R>(in.position, offset);
  TetCornerLanes<R> corner{{R::sub(a.x, x.x), R::sub(a.y, x.y), R::sub(a.z, x.z)}, a.w};
  if constexpr (kExact) corner.at = sum<R>(corner.at, difference<R>(gather<R>(in.low, offset), low));
  return corner;
}

// All slices, in parts of R::kWidth lanes that begin at `first`.
template <class R, class Visit>
[[gnu::always_inline]] inline void for_lanes(const TetHessianInput& in, const Visit& visit) {
  for (const TetSlice* slice = in.slices; slice != in.slices + in.slice_count; ++slice)
    for (int first = 0; first < static_cast<int>(slice->count); first += R::kWidth)
      visit(*slice, first, std::min(R::kWidth, static_cast<int>(slice->count) - first));
}

template <class R>
[[gnu::always_inline]] inline void store_fourth(typename R::Reg value, char* base, const std::uint32_t* offset,
                                                int count) {
  alignas(64) float lanes[R::kWidth];
  R::store(lanes, value);
  for (int i = 0; i < count; ++i) reinterpret_cast<float*>(base + offset[i])[3] = lanes[i];
}

template <class R>
[[gnu::always_inline]] inline void exact_pressures(const TetHessianInput& in) {
  for_lanes<R>(
      in, [&](const TetSlice& slice, int first, int count) __attribute__((always_inline)) {
        const std::uint32_t* const offset = &slice.offset[first];
        const Lanes4<R> x = gather4<R>(in.position, offset);
        const Lanes3<R> low = gather<R>(in.low, offset);
        auto volume = R::all(0);  // six times, and negative
        for (std::uint32_t f = slice.first_face; f != slice.first_face + slice.faces; ++f) {
          const Lanes3<R> a = corner_from<R, true>(in, &in.faces[f].a[first], x, low).at;
          const Lanes3<R> b = corner_from<R, true>(in, &in.faces[f].b[first], x, low).at;
          const Lanes3<R> c = corner_from<R, true>(in, &in.faces[f].c[first], x, low).at;
          volume = R::add(volume, dot<R>(cross<R>(b, c), a));
        }
        const auto pressure = R::minus_fma(R::load(&slice.pressure_scale[first]), volume,
                                           R::sub(R::all(0), R::load(&slice.pressure_shift[first])));
        store_fourth<R>(pressure, in.position, offset, count);
      });
}

template <class R>
[[gnu::always_inline]] inline void exact_forces(const TetHessianInput& in) {
  for_lanes<R>(
      in, [&](const TetSlice& slice, int first, int count) __attribute__((always_inline)) {
        const std::uint32_t* const offset = &slice.offset[first];
        const Lanes4<R> x = gather4<R>(in.position, offset);
        const Lanes3<R> low = gather<R>(in.low, offset);
        Lanes3<R> force = nothing<R>();
        for (std::uint32_t e = slice.first_edge; e != slice.first_edge + slice.edges; ++e)
          force = plus<R>(R::load(&in.edges[e].weight[first]),
                          corner_from<R, true>(in, &in.edges[e].offset[first], x, low).at, force);
        for (std::uint32_t f = slice.first_face; f != slice.first_face + slice.faces; ++f) {
          const TetFaceColumn& face = in.faces[f];
          const TetCornerLanes<R> a = corner_from<R, true>(in, &face.a[first], x, low);
          const TetCornerLanes<R> b = corner_from<R, true>(in, &face.b[first], x, low);
          const TetCornerLanes<R> c = corner_from<R, true>(in, &face.c[first], x, low);
          const Lanes3<R> n = cross<R>(difference<R>(b.at, a.at), difference<R>(c.at, a.at));
          const auto pressures = R::add(R::add(x.w, a.pressure), R::add(b.pressure, c.pressure));
          force = plus<R>(R::sub(R::load(&face.shear[first]), pressures), n, force);
        }
        scatter<R>(force, in.force, offset, count);
      });
}

// Adds to the sums at three edges of each lane.
template <class R>
[[gnu::always_inline]] inline void add_at_edges(char* scratch, const std::uint32_t* slot, std::uint32_t stride,
                                                const Lanes3<R>& n_j, const Lanes3<R>& opposite, const Lanes3<R>& n_i) {
  alignas(64) std::uint32_t offset[R::kWidth];
  alignas(64) float later[32];
  for (int i = 0; i < R::kWidth; ++i) offset[i] = slot[i] + stride * static_cast<std::uint32_t>(i);
  const Lanes3<R>* const vectors[3] = {&n_j, &opposite, &n_i};
  for (int k = 0; k < 3; ++k) {  // no two lanes have an edge in common
    add_scattered<R>(*vectors[k], scratch + 16 * k, offset, later);
    R::add_later(scratch + 16 * k, offset, later);
  }
}

template <class R>
[[gnu::always_inline]] inline Lanes3<R> gather_faces(const TetHessianInput& in, const TetSlice& slice, int first,
                                                     std::uint32_t stride) {
  const Lanes4<R> x = gather4<R>(in.position, &slice.offset[first]);
  const Lanes3<R> none = nothing<R>();
  Lanes3<R> own = none;
  for (std::uint32_t f = slice.first_face; f != slice.first_face + slice.faces; ++f) {
    const TetFaceColumn& face = in.faces[f];
    const TetCornerLanes<R> a = corner_from<R, false>(in, &face.a[first], x, none);
    const TetCornerLanes<R> b = corner_from<R, false>(in, &face.b[first], x, none);
    const TetCornerLanes<R> c = corner_from<R, false>(in, &face.c[first], x, none);
    // c_e / 6, kept within the shear modulus
    const auto shear = R::load(&face.shear[first]), low = R::sub(R::all(0), shear);
    const auto pressures = R::add(R::add(x.w, a.pressure), R::add(b.pressure, c.pressure));
    const auto factor = R::max(low, R::sub(R::all(0), R::max(low, R::sub(shear, pressures))));
    const Lanes3<R> n_a = cross<R>(c.at, b.at), n_b = cross<R>(a.at, c.at), n_c = cross<R>(b.at, a.at);
    const Lanes3<R> n = difference<R>(none, sum<R>(n_a, sum<R>(n_b, n_c)));
    own = sum<R>(own, n);
    const TetFaceEdges& edges = in.face_edges[f];
    add_at_edges<R>(in.scratch, &edges.a[first], stride, n_a, times<R>(factor, difference<R>(c.at, b.at)), n);
    add_at_edges<R>(in.scratch, &edges.b[first], stride, n_b, times<R>(factor, difference<R>(a.at, c.at)), n);
    add_at_edges<R>(in.scratch, &edges.c[first], stride, n_c, times<R>(factor, difference<R>(b.at, a.at)), n);
  }
  return own;
}

template <class R>
[[gnu::always_inline]] inline void linearise_rows(const TetHessianInput& in) {
  for_lanes<R>(
      in, [&](const TetSlice& slice, int first, int) __attribute__((always_inline)) {
        using Reg = typename R::Reg;
        const std::uint32_t stride = kBytesAtEdge * slice.edges;
        auto* const sums = reinterpret_cast<float*>(in.scratch);
        for (std::uint32_t k = 0; k < stride / 4 * R::kWidth; k += R::kWidth) R::store(sums + k, R::all(0));
        const Lanes3<R> own = gather_faces<R>(in, slice, first, stride);
        TetHessianSlice& block = in.blocks[&slice - in.slices];
        const Reg root = R::sqrt(R::load(&slice.pressure_scale[first]));
        const Lanes3<R> g = times<R>(root, own);
        store3<R>(block.g, first, g);
        const Reg l = R::load(&slice.weight_sum[first]);
        Reg xx = R::fma(g.x, g.x, l), yy = R::fma(g.y, g.y, l), zz = R::fma(g.z, g.z, l);
        Reg xy = R::mul(g.x, g.y), xz = R::mul(g.x, g.z), yz = R::mul(g.y, g.z);
        for (std::uint32_t e = 0; e != slice.edges; ++e) {
          alignas(64) std::uint32_t offset[R::kWidth];
          alignas(64) float scale[R::kWidth];
          const std::uint32_t* const to = &in.edges[slice.first_edge + e].offset[first];
          for (int i = 0; i < R::kWidth; ++i) {
            offset[i] = kBytesAtEdge * e + stride * static_cast<std::uint32_t>(i);
            scale[i] = in.pressure_scale[to[i] / 16];
          }
          TetHessianColumn& column = in.columns[slice.first_edge + e];
          store3<R>(column.g, first, times<R>(root, gather<R>(in.scratch, offset)));
          store3<R>(column.s, first, gather<R>(in.scratch + 16, offset));
          const Lanes3<R> t = times<R>(R::sqrt(R::load(scale)), gather<R>(in.scratch + 32, offset));
          store3<R>(column.t, first, t);
          xx = R::fma(t.x, t.x, xx), yy = R::fma(t.y, t.y, yy), zz = R::fma(t.z, t.z, zz);
          xy = R::fma(t.x, t.y, xy), xz = R::fma(t.x, t.z, xz), yz = R::fma(t.y, t.z, yz);
        }
        const Reg entries[6] = {xx, yy, zz, xy, xz, yz};
        for (std::size_t k = 0; k < 6; ++k) R::store(&block.block[k][first], entries[k]);
      });
}

template <class R>
[[gnu::always_inline]] inline void multiply_rows(const TetHessianInput& in) {
  for_lanes<R>(
      in, [&](const TetSlice& slice, int first, int count) __attribute__((always_inline)) {
        const Lanes3<R> p = gather<R>(in.position, &slice.offset[first]);
        auto q = dot<R>(load3<R>(in.blocks[&slice - in.slices].g, first), p);
        for (std::uint32_t e = slice.first_edge; e != slice.first_edge + slice.edges; ++e) {
          const Lanes3<R> o = gather<R>(in.position, &in.edges[e].offset[first]), g = load3<R>(in.columns[e].g, first);
          q = R::fma(g.x, o.x, R::fma(g.y, o.y, R::fma(g.z, o.z, q)));
        }
        store_fourth<R>(q, in.position, &slice.offset[first], count);
      });
  for_lanes<R>(
      in, [&](const TetSlice& slice, int first, int count) __attribute__((always_inline)) {
        const std::uint32_t* const offset = &slice.offset[first];
        const Lanes4<R> p = gather4<R>(in.position, offset);
        Lanes3<R> y = plus<R>(R::load(&slice.weight_sum[first]), {p.x, p.y, p.z}, gather<R>(in.force, offset));
        y = plus<R>(p.w, load3<R>(in.blocks[&slice - in.slices].g, first), y);
        for (std::uint32_t e = slice.first_edge; e != slice.first_edge + slice.edges; ++e) {
          const Lanes4<R> o = gather4<R>(in.position, &in.edges[e].offset[first]);
          const auto weight = R::load(&in.edges[e].weight[first]);
          const Lanes3<R> s = load3<R>(in.columns[e].s, first), t = load3<R>(in.columns[e].t, first);
          const auto row = [&](auto now, auto across, auto a, auto b, auto c, auto d, auto along)
              __attribute__((always_inline)) {
            return R::fma(o.w, along, R::fma(a, b, R::minus_fma(c, d, R::minus_fma(weight, across, now))));
          };
          y = {row(y.x, o.x, s.y, o.z, s.z, o.y, t.x), row(y.y, o.y, s.z, o.x, s.x, o.z, t.y),
               row(y.z, o.z, s.x, o.y, s.y, o.x, t.z)};
        }
        scatter<R>(y, in.force, offset, count);
      });
}

template <class R>
struct TetHessianLoopsOf {
  [[gnu::flatten]] static void pressures(const TetHessianInput& in) { exact_pressures<R>(in); }
  [[gnu::flatten]] static void forces(const TetHessianInput& in) { exact_forces<R>(in); }
  [[gnu::flatten]] static void linearise(const TetHessianInput& in) { linearise_rows<R>(in); }
  [[gnu::flatten]] static void product(const TetHessianInput& in) { multiply_rows<R>(in); }
};
template <class R>
constexpr TetHessianLoops kTetHessianLoops{TetHessianLoopsOf<R>::pressures, TetHessianLoopsOf<R>::forces,
                                           TetHessianLoopsOf<R>::linearise, TetHessianLoopsOf<R>::product};

}  // namespace sectio
