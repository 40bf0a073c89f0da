#include "sim_server/world/recovery.h"

#include <algorithm>
#include <cmath>

#include "common/core/formatted.h"
#include "common/mesh/enclosed_volume.h"

namespace sectio {
namespace {

constexpr std::uint64_t kKeepEvery = 16, kMeasureEvery = 128;  // steps
constexpr int kRestores = 2, kReshapes = 1;                    // rungs of the ladder
constexpr double kForgotten_s = 1;                             // after so long without a flaw the ladder begins anew
constexpr double kStable_s = 0.25;                             // for so long the stable driver goes on
constexpr double kThawAfter_s = 1;                             // without a touch
constexpr int kMostDoublings = 6;

bool within(std::span<const Vec4f> entries, float bound) {
  const float* const x = entries.empty() ? nullptr : entries.front().data();
  int beyond = 0;  // not a bool: the loop is then one of vectors
  for (std::size_t i = 0; i < 4 * entries.size(); ++i) beyond |= std::abs(x[i]) <= bound || i % 4 == 3 ? 0 : 1;
  return beyond == 0;
}

constexpr auto kReach_m = static_cast<float>(kWorldReach_m), kSpeed_m_per_s = static_cast<float>(kMostSpeed_m_per_s);

std::pair<double, double> volumes_now_and_at_rest_m3(const TriangleMesh& mesh, const ParticleView& particles) {
  EnclosedVolume now, rest;
  for (const Triangle& t : mesh.triangles()) {
    if (!t.alive()) continue;
    now.add(particles.position(t.v[0]), particles.position(t.v[1]), particles.position(t.v[2]));
    rest.add(mesh.rest_body_m(t.v[0]), mesh.rest_body_m(t.v[1]), mesh.rest_body_m(t.v[2]));
  }
  return {now.m3(), rest.m3()};
}

std::string describe(const ParticleState& particles, VertexId v) {
  const Vec3 x = particles.position_world_m[v].head<3>().cast<double>();
  const Vec3 u = particles.velocity_world_m_per_s[v].head<3>().cast<double>();
  if (!x.allFinite() || !u.allFinite()) return formatted("vertex %u is not finite", v);
  if (x.cwiseAbs().maxCoeff() > kWorldReach_m) return formatted("vertex %u is %.3g m away", v, x.norm());
  return formatted("vertex %u moves at %.3g m/s", v, u.norm());
}

// Any explosion leaves some of the body nearer than that.
bool is_far_out(const SharedBody& body) {
  const std::span<const Vec4f> x = body.particles.position_world_m;
  bool any = false;
  for (VertexId v = 0; v < body.mesh.vertex_slots(); ++v) {
    if (!body.mesh.vertex_alive(v)) continue;
    any = true;
    if (!x[v].head<3>().allFinite() || within(x.subspan(v, 1), kReach_m / 2)) return false;
  }
  return any && within(body.particles.velocity_world_m_per_s, kSpeed_m_per_s);
}

}  // namespace

VertexId first_beyond_bounds(const ParticleState& particles) {
  const std::span<const Vec4f> x = particles.position_world_m, u = particles.velocity_world_m_per_s;
  if (within(x, kReach_m) && within(u, kSpeed_m_per_s)) return kNone;
  for (VertexId v = 0; v < x.size(); ++v)
    if (!within(x.subspan(v, 1), kReach_m) || !within(u.subspan(v, 1), kSpeed_m_per_s)) return v;
  return kNone;
}

void Recovery::keep(const SharedBody& body, const DeformationEngine& deformation) {
  const bool changed = good_.position_world_m.size() != body.particles.size() || revision_ != body.mesh.revision();
  if (steps_ % kKeepEvery != 0 && !changed) return;
  if (first_beyond_bounds(body.particles) != kNone) return;  // new vertices of a cut may be anywhere
  revision_ = body.mesh.revision();
  good_.position_world_m.assign(body.particles.position_world_m.begin(), body.particles.position_world_m.end());
  deformation.save(good_.engine);
}

std::optional<std::string> Recovery::flaw(const SharedBody& body, const DeformationEngine& deformation) {
  if (const VertexId bad = first_beyond_bounds(body.particles); bad != kNone) return describe(body.particles, bad);
  if (const VertexId bad = deformation.first_bad_vertex(); bad != kNone)
    return formatted("vertex %u was not finite", bad);
  if (steps_ % kMeasureEvery != 0) return std::nullopt;
  const auto [now, rest] = volumes_now_and_at_rest_m3(body.mesh, body.particles.view());
  if (!(rest > 0) || (now >= kLeastVolume * rest && now <= kMostVolume * rest)) return std::nullopt;
  return formatted("it has %.3g of its volume", now / rest);
}

Recovery::Remedy Recovery::next_remedy(double step_s) {
  if (static_cast<double>(steps_ - mended_at_) * step_s > kForgotten_s) mended_ = 0;
  mended_at_ = steps_;
  if (++mended_ <= kRestores) return Remedy::restored;
  if (mended_ <= kRestores + kReshapes) return Remedy::reshaped;
  untouched_s_ = 0;
  ++frozen_;
  return Remedy::frozen;
}

Recovery::Remedy Recovery::mend(const SharedBody& body, DeformationEngine& deformation, double step_s) {
  left_ = left_ || is_far_out(body);
  const Remedy remedy = left_ ? Remedy::left : next_remedy(step_s);
  restore(body, deformation, remedy == Remedy::reshaped);
  deformation.use_stable_driver(static_cast<int>(std::ceil(kStable_s / step_s)));
  return remedy;
}

void Recovery::restore(const SharedBody& body, DeformationEngine& deformation, bool at_rest) {
  ParticleState& particles = body.particles;
  const bool keeps_shape = !deformation.deforms();  // and places the surface itself
  const bool known = (!at_rest || keeps_shape) && good_.position_world_m.size() == particles.size() &&
                     revision_ == body.mesh.revision();
  if (!keeps_shape) {
    particles.position_world_m = known ? good_.position_world_m : std::vector(particles.size(), Vec4f(Vec4f::Zero()));
    std::ranges::fill(particles.velocity_world_m_per_s, Vec4f::Zero());
  }
  deformation.restore(body, known ? &good_.engine : nullptr);
  if (keeps_shape) return;
  for (VertexId v = 0; v < body.mesh.vertex_slots() && !known; ++v)
    if (body.mesh.vertex_alive(v))
      particles.place(v, deformation.rest_frame_world(v).to_world(body.mesh.rest_body_m(v)));
  steps_ += steps_ % kMeasureEvery == 0;  // the volume is measured anew after some steps
}

bool Recovery::thaws(bool touched, double step_s, DeformationEngine& deformation) {
  if (left_) return false;
  untouched_s_ = touched ? 0 : untouched_s_ + step_s;
  if (untouched_s_ < std::ldexp(kThawAfter_s, std::min(frozen_ - 1, kMostDoublings))) return false;
  mended_ = 0;
  deformation.use_stable_driver(static_cast<int>(std::ceil(kStable_s / step_s)));
  return true;
}

}  // namespace sectio
