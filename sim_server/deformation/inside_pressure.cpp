#include "sim_server/deformation/inside_pressure.h"

#include <algorithm>

#include "common/mesh/enclosed_volume.h"

namespace sectio {
namespace {

constexpr double kMostPoisson = 0.49;

// At most this share of V_0 counts, so that a crushed piece opens without a blow.
constexpr double kMostShare = 0.5;

template <class At>
double volume_m3(std::span<const std::array<VertexId, 3>> triangles, const At& at_m) {
  EnclosedVolume volume;
  for (const auto& [a, b, c] : triangles) volume.add(at_m(a), at_m(b), at_m(c));
  return volume.m3();
}

}  // namespace

InsidePressure::InsidePressure(const ElasticMaterial& material)
    : bulk_pa_(material.young_pa / (3 * (1 - 2 * std::min(material.poisson, kMostPoisson)))) {}

std::vector<InsidePressure::Piece> InsidePressure::pieces_of(const TriangleMesh& mesh, const RestFrames& frames) {
  std::vector<Piece> pieces(frames.size());
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    if (!mesh.triangle(t).alive()) continue;
    const auto& corners = mesh.triangle(t).v;
    const std::uint32_t component = frames.component_of(corners[0]);
    if (component != kNone && frames.is_free(component))
      pieces[component].triangles.push_back({corners[0], corners[1], corners[2]});
  }
  std::erase_if(pieces, [](const Piece& p) { return p.triangles.empty(); });
  for (Piece& piece : pieces) {
    for (const auto& corners : piece.triangles)
      piece.vertices.insert(piece.vertices.end(), corners.begin(), corners.end());
    std::ranges::sort(piece.vertices);
    piece.vertices.erase(std::unique(piece.vertices.begin(), piece.vertices.end()), piece.vertices.end());
    piece.rest_volume_m3 = volume_m3(piece.triangles, [&](VertexId v) -> const Vec3& { return mesh.rest_body_m(v); });
  }
  return pieces;
}

void InsidePressure::push(const TriangleMesh& mesh, const RestFrames& frames, double step_s,
                          std::span<const double> inverse_mass_per_kg, std::span<const Vec4f> position_world_m,
                          std::span<Vec4f> velocity_m_per_s) {
  if (!are_known_) {
    pieces_ = pieces_of(mesh, frames);
    gradient_m2_.resize(mesh.vertex_slots());
    are_known_ = true;
  }
  for (const Piece& piece : pieces_) {
    if (!(piece.rest_volume_m3 > 0)) continue;
    const Vec3 near = position_world_m[piece.vertices.front()].head<3>().cast<double>();
    const auto at = [&](VertexId v) { return Vec3(position_world_m[v].head<3>().cast<double>() - near); };
    for (const VertexId v : piece.vertices) gradient_m2_[v].setZero();
    double six_volumes_m3 = 0;
    for (const auto& [a, b, c] : piece.triangles) {
      const Vec3 xa = at(a), xb = at(b), xc = at(c), bc = xb.cross(xc);
      gradient_m2_[a] += bc / 6;
      gradient_m2_[b] += xc.cross(xa) / 6;
      gradient_m2_[c] += xa.cross(xb) / 6;
      six_volumes_m3 += xa.dot(bc);
    }
    double growth_m3_per_s = 0, yields_m4_per_kg = 0;  // yields: the growth of dV/dt by an impulse of pressure
    for (const VertexId v : piece.vertices) {
      growth_m3_per_s += gradient_m2_[v].dot(velocity_m_per_s[v].head<3>().cast<double>());
      yields_m4_per_kg += inverse_mass_per_kg[v] * gradient_m2_[v].squaredNorm();
    }
    const double bulk_per_m3 = bulk_pa_ / piece.rest_volume_m3;
    const double lacking_m3 = piece.rest_volume_m3 - six_volumes_m3 / 6 - step_s * growth_m3_per_s;
    const double most_m3 = kMostShare * piece.rest_volume_m3;
    const double pressure_pa = bulk_per_m3 * std::clamp(lacking_m3, -most_m3, most_m3) /
                               (1 + step_s * step_s * bulk_per_m3 * yields_m4_per_kg);
    for (const VertexId v : piece.vertices)
      velocity_m_per_s[v].head<3>() += (step_s * pressure_pa * inverse_mass_per_kg[v] * gradient_m2_[v]).cast<float>();
  }
}

double InsidePressure::energy_j(const TriangleMesh& mesh, const RestFrames& frames,
                                std::span<const Vec4f> position_world_m) const {
  double energy = 0;
  for (const Piece& piece : pieces_of(mesh, frames)) {
    const double now_m3 =
        volume_m3(piece.triangles, [&](VertexId v) -> Vec3 { return position_world_m[v].head<3>().cast<double>(); });
    const double lacking_m3 = piece.rest_volume_m3 - now_m3;
    if (piece.rest_volume_m3 > 0) energy += 0.5 * bulk_pa_ * lacking_m3 * lacking_m3 / piece.rest_volume_m3;
  }
  return energy;
}

}  // namespace sectio
