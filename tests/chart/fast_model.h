// The common part of the methods that the simulator does not have: tetrahedra in batches of sixteen, floats, behind the
// interface of the volume models.
#pragma once

#include <array>
#include <bit>
#include <cmath>

#include "common/core/error.h"
#include "common/math/fixed_sequence.h"
#include "common/math/lame.h"
#include "sim_server/deformation/simd_width.h"
#include "sim_server/deformation/tetra/tet_star.h"
#include "sim_server/deformation/tetra/volume_model.h"
#include "tests/chart/tet_batch.h"

namespace sectio::chart {

inline const TetLoops16& tet_loops16() {
  return has_avx512() ? tet_loops16_avx512 : tet_loops16_avx2;
}

// The tetrahedra in this order; kNone: a lane stays empty, and names four particles of its own behind the mesh's.
template <class Batch>
std::vector<Batch> batches_of(const TetMesh& mesh, std::span<const std::uint32_t> order) {
  const auto unused = static_cast<VertexId>(mesh.vertices_body_m.size());
  std::vector<Batch> batches((order.size() + kBatch - 1) / kBatch);
  for (std::size_t n = 0; n < batches.size() * kBatch; ++n) {
    Batch& batch = batches[n / kBatch];
    const std::size_t lane = n % kBatch;
    const std::uint32_t t = n < order.size() ? order[n] : kNone;
    for (VertexId k = 0; k < 4; ++k) batch.offset[k][lane] = 16 * (t == kNone ? unused + k : mesh.tetrahedra[t][k]);
    if (t == kNone) {
      for (std::size_t k = 0; k < 3; ++k) batch.gradient[k][k][lane] = 1;
      continue;
    }
    const TetShape shape = tet_shape(mesh, mesh.tetrahedra[t]);
    batch.volume_m3[lane] = static_cast<float>(shape.volume_m3);
    for (std::size_t a = 0; a < 3; ++a)
      for (int i = 0; i < 3; ++i)
        batch.gradient[a][static_cast<std::size_t>(i)][lane] = static_cast<float>(shape.gradient[a + 1][i]);
  }
  return batches;
}
inline std::vector<std::uint32_t> all_in_order(const TetMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.tetrahedra.size());
  for (std::uint32_t t = 0; t < order.size(); ++t) order[t] = t;
  return order;
}

class FastModel : public VolumeModel {
 public:
  FastModel(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings)
      : VolumeModel(material, settings),
        mesh_(mesh),
        mass_(masses_by_volume(mesh, material.density_kg_per_m3)),
        inverse_mass_(mass_.size()) {
    const Lame lame = sectio::lame(material.young_pa, material.poisson);
    tissue_ = {static_cast<float>(lame.lambda_pa), static_cast<float>(lame.mu_pa)};
    for (std::size_t i = 0; i < mass_.size(); ++i)
      inverse_mass_[i] = !settings_.fixed.empty() && settings_.fixed[i] ? 0 : 1 / mass_[i];
  }

  void change(const TetChange&) override {}  // the scenes are cut before they begin
  const TetMesh& mesh() const override { return mesh_; }
  double mass_kg(VertexId v) const override { return mass_[v]; }
  double inverse_mass_per_kg(VertexId v) const override { return inverse_mass_[v]; }
  VertexId first_bad_vertex() const override { return kNone; }
  double energy_j(std::span<const Vec4f>, std::span<const Vec4f>) const override { return 0; }
  void elastic_forces_n(std::span<const Vec4f> position, std::span<Vec3> force) const {
    std::vector<Vec4f> x = with_unused(position), f(x.size());
    forces(x, f);
    for (std::size_t i = 0; i < force.size(); ++i) force[i] = f[i].head<3>().cast<double>();
  }

 protected:
  // Writes all of `force`. Both with room for unused particles.
  virtual void forces(std::span<const Vec4f> x, std::span<Vec4f> force) const = 0;

  static std::vector<Vec4f> with_unused(std::span<const Vec4f> particles) {
    std::vector<Vec4f> all(particles.begin(), particles.end());
    all.resize(all.size() + 4, Vec4f::Zero());
    return all;
  }
  static char* bytes(std::vector<Vec4f>& v) { return reinterpret_cast<char*>(v.data()); }
  static char* bytes(std::span<Vec4f> v) { return reinterpret_cast<char*>(v.data()); }
  static const char* bytes(std::span<const Vec4f> v) { return reinterpret_cast<const char*>(v.data()); }
  std::size_t particles() const { return mass_.size(); }

  TetMesh mesh_;
  std::vector<double> mass_, inverse_mass_;
  TetMaterial tissue_;
};

}  // namespace sectio::chart
