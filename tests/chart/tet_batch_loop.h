// The loops of tet_batch.h; only tet_batch_avx*.cpp include this file.
#pragma once

#include "sim_server/deformation/simd.h"
#include "tests/chart/tet_batch.h"

namespace sectio::chart {
namespace {

template <class R>
struct BatchLoop {
  using Reg = typename R::Reg;
  using Lanes = Lanes3<R>;

  struct Matrix {
    Lanes column[3];
  };

  static Lanes minus(const Lanes& a, const Lanes& b) { return {R::sub(a.x, b.x), R::sub(a.y, b.y), R::sub(a.z, b.z)}; }
  static Lanes plus(const Lanes& a, const Lanes& b) { return {R::add(a.x, b.x), R::add(a.y, b.y), R::add(a.z, b.z)}; }
  static Lanes times(Reg s, const Lanes& a) { return {R::mul(s, a.x), R::mul(s, a.y), R::mul(s, a.z)}; }
  // b + s a
  static Lanes add_times(const Lanes& b, Reg s, const Lanes& a) {
    return {R::fma(s, a.x, b.x), R::fma(s, a.y, b.y), R::fma(s, a.z, b.z)};
  }
  static Lanes zero() { return {R::all(0), R::all(0), R::all(0)}; }
  static Lanes product(const Matrix& m, const Lanes& a) {
    return add_times(add_times(times(a.x, m.column[0]), a.y, m.column[1]), a.z, m.column[2]);
  }
  static Lanes transposed_product(const Matrix& m, const Lanes& a) {
    return {dot<R>(m.column[0], a), dot<R>(m.column[1], a), dot<R>(m.column[2], a)};
  }
  static Lanes load(const float (&g)[3][kBatch], int at) {
    return {R::load(g[0] + at), R::load(g[1] + at), R::load(g[2] + at)};
  }
  static void store(float (&g)[3][kBatch], int at, const Lanes& a) {
    R::store(g[0] + at, a.x), R::store(g[1] + at, a.y), R::store(g[2] + at, a.z);
  }

  // sum_a (p_a - p_0) g_a^T
  static Matrix gradient(const Lanes (&edge)[3], const Lanes (&g)[3]) {
    Matrix f;
    const Reg by[3][3] = {{g[0].x, g[1].x, g[2].x}, {g[0].y, g[1].y, g[2].y}, {g[0].z, g[1].z, g[2].z}};
    for (int j = 0; j < 3; ++j)
      f.column[j] = add_times(add_times(times(by[j][0], edge[0]), by[j][1], edge[1]), by[j][2], edge[2]);
    return f;
  }
  static Matrix cofactor(const Matrix& f) {
    return {
        {cross<R>(f.column[1], f.column[2]), cross<R>(f.column[2], f.column[0]), cross<R>(f.column[0], f.column[1])}};
  }

  static void read(const std::uint32_t (&offset)[4][kBatch], int at, const char* from, Lanes (&edge)[3]) {
    const Lanes first = gather<R>(from, offset[0] + at);
    for (int a = 0; a < 3; ++a) edge[a] = minus(gather<R>(from, offset[a + 1] + at), first);
  }
  // The force on corner 0 is minus the sum of the others.
  static void add(const Lanes (&force)[3], const std::uint32_t (&offset)[4][kBatch], int at, char* to) {
    const Lanes sum = plus(plus(force[0], force[1]), force[2]);
    const Lanes all[4] = {
        {R::sub(R::all(0), sum.x), R::sub(R::all(0), sum.y), R::sub(R::all(0), sum.z)}, force[0], force[1], force[2]};
    alignas(64) float later[4][32];
    for (int a = 0; a < 4; ++a) add_scattered<R>(all[a], to, offset[a] + at, later[a]);
    for (int a = 0; a < 4; ++a) R::add_later(to, offset[a] + at, later[a]);
  }
  template <class B>
  static void gradients(const B& b, int at, Lanes (&g)[3]) {
    for (int a = 0; a < 3; ++a) g[a] = load(b.gradient[a], at);
  }

  static void neo_hookean(const TetBatch* batch, std::size_t count, const TetMaterial& m, const char* position,
                          char* force) {
    const Reg mu = R::all(m.mu_pa), kappa = R::all(m.lambda_pa + m.mu_pa), one = R::all(1);
    for (std::size_t n = 0; n < count; ++n)
      for (int at = 0; at < kBatch; at += R::kWidth) {
        const TetBatch& b = batch[n];
        Lanes edge[3], g[3], f_n[3];
        read(b.offset, at, position, edge);
        gradients(b, at, g);
        const Matrix f = gradient(edge, g), cof = cofactor(f);
        const Reg bulk = R::sub(R::mul(kappa, R::sub(dot<R>(f.column[0], cof.column[0]), one)), mu);
        const Reg minus_v = R::sub(R::all(0), R::load(b.volume_m3 + at));
        Matrix stress;
        for (int j = 0; j < 3; ++j) stress.column[j] = add_times(times(bulk, cof.column[j]), mu, f.column[j]);
        for (int a = 0; a < 3; ++a) f_n[a] = times(minus_v, product(stress, g[a]));
        add(f_n, b.offset, at, force);
      }
  }

  // One constraint: moves the corners along the slopes, and keeps the multiplier.
  struct Corners {
    Lanes x[4];
    Reg inverse_mass[4];
  };
  static void correct(Corners& c, const Matrix& slope, const Lanes (&g)[3], Reg value, Reg compliance,
                      float* multiplier) {
    Lanes s[4];
    for (int a = 0; a < 3; ++a) s[a + 1] = product(slope, g[a]);
    s[0] = minus(zero(), plus(plus(s[1], s[2]), s[3]));
    Reg sum = compliance;
    for (int a = 0; a < 4; ++a) sum = R::fma(c.inverse_mass[a], dot<R>(s[a], s[a]), sum);
    const Reg before = R::load(multiplier);
    const Reg change = R::div(R::sub(R::all(0), R::fma(compliance, before, value)), sum);
    R::store(multiplier, R::add(before, change));
    for (int a = 0; a < 4; ++a) c.x[a] = add_times(c.x[a], R::mul(c.inverse_mass[a], change), s[a]);
  }
  static Matrix gradient_of(const Corners& c, const Lanes (&g)[3]) {
    const Lanes edge[3] = {minus(c.x[1], c.x[0]), minus(c.x[2], c.x[0]), minus(c.x[3], c.x[0])};
    return gradient(edge, g);
  }

  static void solve_constraints(XpbdBatch* batch, std::size_t count, const TetMaterial& m, float step_s,
                                char* position) {
    const Reg per_step2 = R::all(1 / (step_s * step_s));
    const Reg rest = R::all(1 + m.mu_pa / (m.lambda_pa + m.mu_pa));
    for (std::size_t n = 0; n < count; ++n)
      for (int at = 0; at < kBatch; at += R::kWidth) {
        XpbdBatch& b = batch[n];
        Corners c;
        Lanes g[3];
        gradients(b, at, g);
        for (int a = 0; a < 4; ++a) {
          const Lanes4<R> all = gather4<R>(position, b.offset[a] + at);
          c.x[a] = {all.x, all.y, all.z};
          c.inverse_mass[a] = all.w;
        }
        Matrix f = gradient_of(c, g);
        const Reg squares = R::add(R::add(dot<R>(f.column[0], f.column[0]), dot<R>(f.column[1], f.column[1])),
                                   R::add(dot<R>(f.column[2], f.column[2]), R::all(1e-12f)));
        const Reg norm = R::sqrt(squares), by = R::div(R::all(1), norm);
        for (Lanes& column : f.column) column = times(by, column);
        correct(c, f, g, norm, R::mul(per_step2, R::load(b.compliance[0] + at)), b.multiplier[0] + at);
        f = gradient_of(c, g);
        const Matrix cof = cofactor(f);
        const Reg value = R::sub(dot<R>(f.column[0], cof.column[0]), rest);
        correct(c, cof, g, value, R::mul(per_step2, R::load(b.compliance[1] + at)), b.multiplier[1] + at);
        for (int a = 0; a < 4; ++a)
          scatter4<R>({c.x[a].x, c.x[a].y, c.x[a].z, c.inverse_mass[a]}, position, b.offset[a] + at, R::kWidth);
      }
  }

  struct Quaternion {
    Reg w;
    Lanes v;
  };
  static Matrix matrix_of(const Quaternion& q) {
    const Reg two = R::all(2), one = R::all(1);
    const auto part = [&](Reg a, Reg b, Reg c, Reg d) { return R::mul(two, R::fma(a, b, R::mul(c, d))); };
    const Reg minus_w = R::sub(R::all(0), q.w);
    const auto [x, y, z] = q.v;
    const auto diagonal = [&](Reg a, Reg b) { return R::minus_fma(two, R::fma(a, a, R::mul(b, b)), one); };
    return {{{diagonal(y, z), part(x, y, q.w, z), part(x, z, minus_w, y)},
             {part(x, y, minus_w, z), diagonal(x, z), part(y, z, q.w, x)},
             {part(x, z, q.w, y), part(y, z, minus_w, x), diagonal(x, y)}}};
  }
  static Matrix back(const Matrix& r, const Matrix& f) {  // r^T f
    return {
        {transposed_product(r, f.column[0]), transposed_product(r, f.column[1]), transposed_product(r, f.column[2])}};
  }
  // A Newton step of the rotation towards that of the polar decomposition (Kugelstadt et al. 2018): with b = r^T f and
  // s its symmetric part, (tr(s) 1 - s) angle = the axial vector of b - b^T.
  static Quaternion improved(const Quaternion& q, const Matrix& f) {
    const Matrix b = back(matrix_of(q), f);
    const auto &c0 = b.column[0], &c1 = b.column[1], &c2 = b.column[2];
    const Lanes axial = {R::sub(c1.z, c2.y), R::sub(c2.x, c0.z), R::sub(c0.y, c1.x)};
    const Reg minus_half = R::all(-0.5f), little = R::all(1e-3f);
    const Reg xy = R::mul(minus_half, R::add(c0.y, c1.x)), yz = R::mul(minus_half, R::add(c1.z, c2.y)),
              zx = R::mul(minus_half, R::add(c2.x, c0.z));
    const Reg xx = R::add(R::add(c1.y, c2.z), little), yy = R::add(R::add(c0.x, c2.z), little),
              zz = R::add(R::add(c0.x, c1.y), little);
    const Matrix h = {{{xx, xy, zx}, {xy, yy, yz}, {zx, yz, zz}}};
    const Matrix adjugate = cofactor(h);
    const Reg determinant = R::max(dot<R>(h.column[0], adjugate.column[0]), little);
    const Lanes half_angle = times(R::div(R::all(0.5f), determinant), product(adjugate, axial));
    const Lanes turned = plus(add_times(cross<R>(q.v, half_angle), q.w, half_angle), q.v);
    const Reg w = R::sub(q.w, dot<R>(q.v, half_angle));
    const Reg by = R::div(R::all(1), R::sqrt(R::fma(w, w, dot<R>(turned, turned))));
    return {R::mul(by, w), times(by, turned)};
  }

  static void add_one(const Lanes& value, const std::uint32_t (&offset)[kBatch], int at, char* to) {
    alignas(64) float later[32];
    add_scattered<R>(value, to, offset + at, later);
    R::add_later(to, offset + at, later);
  }
  static void add_diagonal(const CorotatedBatch& b, int at, const Lanes (&g)[3], Reg lambda_v, Reg mu_v,
                           char* const* diagonal) {
    const Lanes all[4] = {minus(zero(), plus(plus(g[0], g[1]), g[2])), g[0], g[1], g[2]};
    const Reg both = R::add(lambda_v, mu_v);
    for (int a = 0; a < 4; ++a) {
      const Lanes& k = all[a];
      const Reg squares = R::mul(mu_v, dot<R>(k, k));
      const Lanes s = times(both, k);
      add_one({R::fma(s.x, k.x, squares), R::fma(s.y, k.y, squares), R::fma(s.z, k.z, squares)}, b.offset[a], at,
              diagonal[0]);
      add_one({R::mul(s.x, k.y), R::mul(s.y, k.z), R::mul(s.z, k.x)}, b.offset[a], at, diagonal[1]);
    }
  }

  static void corotate(CorotatedBatch* batch, std::size_t count, const TetMaterial& m, int iterations,
                       const char* position, char* force, char* const* diagonal) {
    for (std::size_t n = 0; n < count; ++n)
      for (int at = 0; at < kBatch; at += R::kWidth) {
        CorotatedBatch& b = batch[n];
        Lanes edge[3], g[3], rotated[3], f_n[3];
        read(b.offset, at, position, edge);
        gradients(b, at, g);
        const Matrix f = gradient(edge, g);
        Quaternion q = {R::load(b.rotation[0] + at),
                        {R::load(b.rotation[1] + at), R::load(b.rotation[2] + at), R::load(b.rotation[3] + at)}};
        for (int i = 0; i < iterations; ++i) q = improved(q, f);
        R::store(b.rotation[0] + at, q.w);
        R::store(b.rotation[1] + at, q.v.x), R::store(b.rotation[2] + at, q.v.y), R::store(b.rotation[3] + at, q.v.z);
        const Matrix r = matrix_of(q), e = back(r, f);
        const Reg v = R::load(b.volume_m3 + at), lambda_v = R::mul(R::all(m.lambda_pa), v),
                  mu_v = R::mul(R::all(m.mu_pa), v), two = R::all(2);
        const Reg trace = R::sub(R::add(R::add(e.column[0].x, e.column[1].y), e.column[2].z), R::all(3));
        const Reg bulk = R::fma(lambda_v, trace, R::mul(R::all(-2), mu_v));
        const Reg xy = R::mul(mu_v, R::add(e.column[0].y, e.column[1].x)),
                  yz = R::mul(mu_v, R::add(e.column[1].z, e.column[2].y)),
                  zx = R::mul(mu_v, R::add(e.column[2].x, e.column[0].z));
        const auto along = [&](Reg a) { return R::fma(R::mul(two, mu_v), a, bulk); };
        const Matrix stress = {
            {{along(e.column[0].x), xy, zx}, {xy, along(e.column[1].y), yz}, {zx, yz, along(e.column[2].z)}}};
        for (int a = 0; a < 3; ++a) {
          rotated[a] = product(r, g[a]);
          store(b.rotated[a], at, rotated[a]);
          f_n[a] = minus(zero(), product(r, product(stress, g[a])));
        }
        add(f_n, b.offset, at, force);
        if (diagonal) add_diagonal(b, at, rotated, lambda_v, mu_v, diagonal);
      }
  }

  static void multiply(const CorotatedBatch* batch, std::size_t count, const TetMaterial& m, const char* in,
                       char* out) {
    for (std::size_t n = 0; n < count; ++n)
      for (int at = 0; at < kBatch; at += R::kWidth) {
        const CorotatedBatch& b = batch[n];
        Lanes edge[3], g[3], f_n[3];
        read(b.offset, at, in, edge);
        for (int a = 0; a < 3; ++a) g[a] = load(b.rotated[a], at);
        const Matrix d = gradient(edge, g);
        const Reg v = R::load(b.volume_m3 + at), mu_v = R::mul(R::all(m.mu_pa), v), two_mu = R::add(mu_v, mu_v);
        const Reg bulk =
            R::mul(R::mul(R::all(m.lambda_pa), v), R::add(R::add(d.column[0].x, d.column[1].y), d.column[2].z));
        const Reg xy = R::mul(mu_v, R::add(d.column[0].y, d.column[1].x)),
                  yz = R::mul(mu_v, R::add(d.column[1].z, d.column[2].y)),
                  zx = R::mul(mu_v, R::add(d.column[2].x, d.column[0].z));
        const Matrix stress = {{{R::fma(two_mu, d.column[0].x, bulk), xy, zx},
                                {xy, R::fma(two_mu, d.column[1].y, bulk), yz},
                                {zx, yz, R::fma(two_mu, d.column[2].z, bulk)}}};
        for (int a = 0; a < 3; ++a) f_n[a] = product(stress, g[a]);
        add(f_n, b.offset, at, out);
      }
  }
};

template <class R>
constexpr TetLoops16 kTetLoops16 = {BatchLoop<R>::neo_hookean, BatchLoop<R>::solve_constraints, BatchLoop<R>::corotate,
                                    BatchLoop<R>::multiply};

}  // namespace
}  // namespace sectio::chart
